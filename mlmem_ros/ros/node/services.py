# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The services: each hands a command to the loop and answers when it is done. The callback guard
answers those that are refused.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from diagnostic_msgs.srv import SelfTest as SelfTestService
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.node import Node
from std_srvs.srv import SetBool

from mlmem import SIMULATION_NAME, Command, SelfTest, Write
from mlmem.procedure_table import PROCEDURES

from ...contract import answers
from ...contract.commands import COMMAND_TOPICS
from ...contract.requests import NODE_SERVICES, Record, build_command, parse_request
from ...contract.streams import select_streams
from ...contract.topics import Qos, load_interface
from ...host import Host, SessionPlan
from ...host.settings import Parameters
from .callback_guard import await_future
from .topics import build_test_statuses


class Services:
    """Answers requests while the loop runs: a waiting request is a suspended coroutine."""

    def __init__(self, node: Node, host: Host, plan: Callable[[str], SessionPlan]) -> None:
        """Serve `NODE_SERVICES`; `plan` returns what a session records into a path, or into that
        of the node.
        """
        self._node = node
        self._host = host
        self._plan = plan
        own = {
            'self_test': self._answer_self_test,
            'request': self._answer_request,
            'pause': self._answer_pause,
            'step': self._answer_step,
            'record': self._answer_record,
        }
        for service in NODE_SERVICES:
            answer = own.get(service.name) or self._build_procedure_callback(service.name)
            kind, path = load_interface(service.type), f'~/{service.name}'
            node.create_service(kind, path, answer, qos_profile=Qos.KEEP_ALL.profile)

    def _build_procedure_callback(self, name: str) -> Callable[[Any, Any], Any]:
        """Return the callback of a Trigger; what a procedure must be given is a parameter."""

        async def run_procedure(_: Any, response: Any) -> Any:
            parameters = PROCEDURES[name].target_parameters.items()
            given = {each: self._node.get_parameter(of).value for each, of in parameters}
            answer = await self._run_command(build_command(name, given))
            response.success, response.message = answer
            return response

        return run_procedure

    async def _answer_request(
        self, request: SetParametersAtomically.Request, response: SetParametersAtomically.Response
    ) -> SetParametersAtomically.Response:
        asked, wait = parse_request(request.parameters, self._host.content_name)
        doing = (
            self._run_recording(asked.on, asked.path)
            if isinstance(asked, Record)
            else self._run_command(asked, wait)
        )
        response.result.successful, response.result.reason = await doing
        return response

    async def _run_command(self, command: Command, wait: float = 0.0) -> tuple[bool, str]:
        outcome = await await_future(self._host.submit(command, wait).answer)
        if outcome is None:  # accepted, with nothing to wait for
            return True, '{}'
        asked = {'asked': command.level} if isinstance(command, Write) else {}
        return outcome.success, answers.format_answer(outcome, **asked)

    async def _run_recording(self, on: bool, path: str = '') -> tuple[bool, str]:
        bag = await await_future(self._host.record(self._plan(path) if on else None))
        return True, json.dumps({'recording': on, 'path': str(bag)})

    async def _answer_record(self, request: SetBool.Request, response: Any) -> Any:
        response.success, response.message = await self._run_recording(request.data)
        return response

    async def _answer_pause(self, request: SetBool.Request, response: Any) -> Any:
        tick = await await_future(self._host.pause(request.data))
        response.message = json.dumps({'paused': request.data, 'tick': tick})
        response.success = True
        return response

    async def _answer_step(self, _: Any, response: Any) -> Any:
        tick = await await_future(self._host.step().answer)
        response.success, response.message = True, json.dumps({'tick': tick})
        return response

    async def _answer_self_test(
        self, _: SelfTestService.Request, response: SelfTestService.Response
    ) -> SelfTestService.Response:
        response.id = name = self._node.get_fully_qualified_name()
        outcome = await await_future(self._host.submit(SelfTest(), 0.0).answer)
        assert outcome is not None
        response.passed = bytes([outcome.success])
        response.status = build_test_statuses(outcome, name)
        return response


def build_session_plan(node: Node, given: Parameters, path: str = '') -> SessionPlan:
    """Return what a session of a node records as its parameters say; a path takes the place of
    theirs.
    """
    settings = replace(given.record, path=path) if path else given.record
    streams = select_streams(given.settings.holds_words, given.device.driver == SIMULATION_NAME)
    recorded = [stream for stream in streams if stream.is_recorded]
    return SessionPlan(
        node.get_fully_qualified_name(),
        settings,
        [
            replace(topic, name=node.resolve_topic_name(f'~/{topic.name}'))
            for topic in (*COMMAND_TOPICS, *recorded)
        ],
        {name: node.get_parameter(name).value for name in node.list_parameters([], 0).names},
        given.files,
    )
