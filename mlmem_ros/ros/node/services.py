# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The services: each hands a command to the loop and answers when it is done. The callback guard
answers those that are refused.
"""

from __future__ import annotations

import json
from collections.abc import Awaitable, Callable
from concurrent.futures import Future
from dataclasses import replace
from typing import Any

from diagnostic_msgs.srv import SelfTest as SelfTestService
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.node import Node
from std_srvs.srv import SetBool, Trigger

from mlmem import Command, Refused, SelfTest, Write
from mlmem.instrument import drivers
from mlmem.procedure_table import PROCEDURES, Procedure

from ...contract import answers, messages
from ...contract.commands import COMMAND_TOPICS
from ...contract.requests import Record, build_command, parse_request
from ...contract.streams import select_streams
from ...contract.topics import Qos
from ...host import Host, SessionPlan
from ...host.settings import Parameters
from .callback_guard import await_future

Answered = Awaitable[tuple[bool, str]]
"""Whether a request succeeded, and the JSON object that answers it."""


class Services:
    """Answers requests while the loop runs: a waiting request is a suspended coroutine."""

    def __init__(self, node: Node, host: Host, plan: Callable[[str], SessionPlan]) -> None:
        """Serve; `plan` returns what a session records into a path, or into that of the node."""
        self._node = node
        self._host = host
        self._plan = plan
        for name, row in PROCEDURES.items():
            # a self-test answers in a type of its own
            if row.has_service and name != 'self_test':
                self._create_json_service(Trigger, name, self._build_procedure_answer(name, row))
        self._create_json_service(Trigger, 'step', lambda _: _answer_ticks(host.step().answer))
        self._create_json_service(SetBool, 'pause', self._run_pause)
        self._create_json_service(
            SetBool, 'record', lambda request: self._run_recording(Record(request.data))
        )
        self._create_service(SetParametersAtomically, 'request', self._answer_request)
        self._create_service(SelfTestService, 'self_test', self._answer_self_test)

    def _build_procedure_answer(self, name: str, row: Procedure) -> Callable[[Any], Answered]:
        """Return the answer to a Trigger; what it must be given is a parameter."""

        def run_procedure(_: Any) -> Answered:
            parameters = row.target_parameters.items()
            given = {each: self._node.get_parameter(of).value for each, of in parameters}
            return self._run_command(build_command(name, given))

        return run_procedure

    def _create_json_service(
        self, kind: type[Any], name: str, answer: Callable[[Any], Answered]
    ) -> None:
        async def serve_request(request: Any, response: Any) -> Any:
            response.success, response.message = await answer(request)
            return response

        self._create_service(kind, name, serve_request)

    def _create_service(self, kind: type[Any], name: str, callback: Callable[..., Any]) -> None:
        self._node.create_service(kind, f'~/{name}', callback, qos_profile=Qos.KEEP_ALL.profile)

    async def _answer_request(
        self, request: SetParametersAtomically.Request, response: SetParametersAtomically.Response
    ) -> SetParametersAtomically.Response:
        try:
            asked, wait = parse_request(request.parameters)
        except Refused:
            self._host.refused += 1
            raise
        doing = (
            self._run_recording(asked)
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

    async def _run_recording(self, asked: Record) -> tuple[bool, str]:
        path = await await_future(self._host.record(self._plan(asked.path) if asked.on else None))
        return True, json.dumps({'recording': asked.on, 'path': str(path)})

    def _run_pause(self, request: SetBool.Request) -> Answered:
        return _answer_ticks(self._host.pause(request.data), paused=request.data)

    async def _answer_self_test(
        self, _: SelfTestService.Request, response: SelfTestService.Response
    ) -> SelfTestService.Response:
        response.id = name = self._node.get_fully_qualified_name()
        outcome = await await_future(self._host.submit(SelfTest(), 0.0).answer)
        assert outcome is not None
        response.passed = bytes([outcome.success])
        response.status = messages.build_test_statuses(outcome, name)
        return response


async def _answer_ticks(ticks: Future[int], **said: Any) -> tuple[bool, str]:
    return True, json.dumps({**said, 'tick': await await_future(ticks)})


def build_session_plan(node: Node, given: Parameters, path: str = '') -> SessionPlan:
    """Return what a session of a node records as its parameters say; a path takes the place of
    theirs.
    """
    settings = replace(given.record, path=path) if path else given.record
    streams = select_streams(
        bool(given.settings.register.spacing), given.device.driver == drivers.SIMULATION_NAME
    )
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
