# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The services: each hands a command to the loop and answers when it is done."""

from __future__ import annotations

import json
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

from rclpy.node import Node
from rclpy.task import Future as RosFuture
from std_srvs.srv import SetBool, Trigger

from ..device import Abort, Calibrate, Command, Erase, Loop, Outcome, Read, Refused, Write
from . import messages


class Services:
    """Answers requests while the loop runs: a waiting request is a suspended coroutine."""

    def __init__(self, node: Node, loop: Loop) -> None:
        self._node = node
        self._loop = loop
        procedures: dict[str, Callable[[], Command]] = {
            '~/write': lambda: Write(node.get_parameter('target_level').value),
            '~/read': Read,
            '~/erase': Erase,
            '~/calibrate': Calibrate,
            '~/abort': Abort,
        }
        for name, command in procedures.items():
            node.create_service(Trigger, name, self._procedure(command))
        node.create_service(SetBool, '~/pause', self._pause)
        node.create_service(Trigger, '~/step', self._step)

    def _procedure(self, command: Callable[[], Command]) -> Callable[..., Any]:
        async def serve(_: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
            try:
                outcome: Outcome = await self._result(self._loop.submit(command()))
            except Refused as refusal:
                response.message = messages.refusal(str(refusal))
            else:
                response.success = outcome.success
                response.message = messages.answer(outcome)
            return response

        return serve

    def _pause(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        self._loop.pause(request.data)
        response.success = True
        response.message = json.dumps({'paused': request.data, 'tick': self._loop.element.ticks})
        return response

    async def _step(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        try:
            tick = await self._result(self._loop.single_tick())
        except Refused as refusal:
            response.message = messages.refusal(str(refusal))
        else:
            response.success = True
            response.message = json.dumps({'tick': tick})
        return response

    def _result(self, answer: Future[Any]) -> RosFuture:
        """Return what a coroutine awaits: it is resumed when the loop's thread has answered."""
        executor = self._node.executor
        future = RosFuture(executor=executor)

        def done(answer: Future[Any]) -> None:
            if (refusal := answer.exception()) is not None:
                future.set_exception(refusal)
            else:
                future.set_result(answer.result())
            executor.wake()

        answer.add_done_callback(done)
        return future
