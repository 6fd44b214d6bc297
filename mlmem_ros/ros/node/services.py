# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The services: each hands a command to the loop and answers when it is done."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

from diagnostic_msgs.srv import SelfTest as SelfTestService
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.node import Node
from std_srvs.srv import SetBool, Trigger

from ...contract import answers, messages
from ...contract.commands import Record, requested
from ...device import Abort, Calibrate, Command, Erase, Outcome, Read, Refused, SelfTest, Write
from ...host import REFUSALS, Host
from ..qos import EVERY_ONE
from .boundary import settled
from .recorded import session_plan


class Services:
    """Answers requests while the loop runs: a waiting request is a suspended coroutine."""

    def __init__(self, node: Node, host: Host) -> None:
        self._node = node
        self._host = host
        procedures: dict[str, Callable[[], Command]] = {
            '~/write': lambda: Write(node.get_parameter('target_level').value),
            '~/read': Read,
            '~/erase': Erase,
            '~/calibrate': Calibrate,
            '~/abort': Abort,
        }

        def serve(kind: type[Any], name: str, callback: Callable[..., Any]) -> None:
            node.create_service(kind, name, callback, qos_profile=EVERY_ONE)

        for name, command in procedures.items():
            serve(Trigger, name, self._procedure(command))
        serve(SetParametersAtomically, '~/request', self._request)
        serve(SelfTestService, '~/self_test', self._self_test)
        serve(SetBool, '~/pause', self._pause)
        serve(SetBool, '~/record', self._record)
        serve(Trigger, '~/step', self._step)

    def _procedure(self, command: Callable[[], Command]) -> Callable[..., Any]:
        async def serve(_: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
            response.success, response.message = await self._done(command())
            return response

        return serve

    async def _request(
        self, request: SetParametersAtomically.Request, response: SetParametersAtomically.Response
    ) -> SetParametersAtomically.Response:
        result = response.result
        try:
            asked = requested(request.parameters)
        except Refused as refusal:
            self._host.refused += 1
            result.reason = answers.refusal(refusal)
        else:
            doing = self._recorded if isinstance(asked, Record) else self._done
            result.successful, result.reason = await doing(asked)
        return response

    async def _done(self, command: Command) -> tuple[bool, str]:
        """Make the device do something; return whether it succeeded, and the answer."""
        asked = {'asked': command.level} if isinstance(command, Write) else {}
        try:
            outcome: Outcome | None = await settled(self._host.submit(command))
        except REFUSALS as failure:
            return False, answers.refusal(failure, **asked)
        if outcome is None:  # accepted, with nothing to wait for
            return True, '{}'
        return outcome.success, answers.answer(outcome, **asked)

    async def _self_test(
        self, _: SelfTestService.Request, response: SelfTestService.Response
    ) -> SelfTestService.Response:
        response.id = name = self._node.get_fully_qualified_name()
        try:
            outcome: Outcome = await settled(self._host.submit(SelfTest()))
        except REFUSALS as failure:
            response.status = [messages.refused_test(name, str(failure))]
        else:
            response.passed = bytes([outcome.success])
            response.status = messages.test_statuses(outcome, name)
        return response

    async def _pause(
        self, request: SetBool.Request, response: SetBool.Response
    ) -> SetBool.Response:
        try:
            tick = await settled(self._host.pause(request.data))
        except REFUSALS as refusal:
            response.message = answers.refusal(refusal)
        else:
            response.success = True
            response.message = json.dumps({'paused': request.data, 'tick': tick})
        return response

    async def _record(
        self, request: SetBool.Request, response: SetBool.Response
    ) -> SetBool.Response:
        response.success, response.message = await self._recorded(Record(request.data))
        return response

    async def _recorded(self, asked: Record) -> tuple[bool, str]:
        """Begin or end a session; return whether it succeeded, and the answer."""
        try:
            plan = session_plan(self._node, path=asked.path) if asked.on else None
            path = await settled(self._host.record(plan))
        except REFUSALS as refusal:
            return False, answers.refusal(refusal)
        return True, json.dumps({'recording': asked.on, 'path': str(path)})

    async def _step(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        try:
            tick = await settled(self._host.step())
        except REFUSALS as refusal:
            response.message = answers.refusal(refusal)
        else:
            response.success = True
            response.message = json.dumps({'tick': tick})
        return response
