# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The one way in from ROS: no exception leaves a callback, and every request is answered.

Services may be coroutines that await futures of the loop's thread. They are not rclpy tasks, since
how those resume depends on the executor and its version. Ours resume in the thread that settles
the future, and send the response from there.
"""

from __future__ import annotations

import inspect
import threading
import time
import types
from collections.abc import Callable, Coroutine, Generator, Sequence
from concurrent.futures import Future
from contextlib import suppress
from typing import Any, NamedTuple, TypeVar

from action_msgs.msg import GoalStatus
from diagnostic_msgs.msg import DiagnosticStatus
from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock, ClockType
from rclpy.exceptions import InvalidHandle
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.timer import Timer

from ...contract import answers
from ...host import REFUSALS, ThrottledLog

T = TypeVar('T')

RESEND_DELAYS_S = 0.2, 1.0, 4.0
"""Seconds before an answer that was dropped is sent once more; clients ignore a second one."""


@types.coroutine
def await_future(future: Future[T]) -> Generator[Future[T], None, T]:
    """Wait for a future of any thread; for the coroutines of services."""
    if not future.done():
        yield future
    return future.result()


class _Answer(NamedTuple):
    """What a service's callback returns to the executor, which hands it to `send_response`."""

    steps: Coroutine[Future[Any], None, Any]

    def run(self, send: Callable[[Any], None]) -> None:
        """Run until a future is awaited, resume once it is done; finally send the response."""
        try:
            awaited = self.steps.send(None)
        except StopIteration as end:
            send(end.value)
        else:
            awaited.add_done_callback(lambda _: self.run(send))


class CallbackGuard:
    """Guards the callbacks of a node.

    Attributes:
        waiting: Ids of the requests not answered yet.
    """

    def __init__(self, node: Node, log: ThrottledLog) -> None:
        self.waiting: set[int] = set()
        self._held: Future[None] | None = None  # done when held requests may go on
        self._node = node
        self._log = log
        self._steady = Clock(clock_type=ClockType.STEADY_TIME)

    def hold_requests(self) -> None:
        """Let requests to services of our own wait until `release_requests`."""
        self._held = Future()

    def release_requests(self) -> None:
        """Let requests go on, those that wait first."""
        held, self._held = self._held, None
        if held is not None:
            held.set_result(None)

    async def wait_while_held(self) -> None:
        """Wait until requests are not held."""
        if self._held is not None:
            await await_future(self._held)

    def call_every(self, seconds: float, where: str, callback: Callable[[], None]) -> Timer:
        """Call back periodically by the machine's clock, even while simulated time stands."""

        def call_guarded() -> None:  # since Kilted, one with arguments gets the timer's times
            with self._log.guard_errors(where):
                callback()

        return self._node.create_timer(seconds, call_guarded, clock=self._steady)

    def guard_services(self) -> None:
        """Guard every service of the node, rclpy's own included; answer with the error."""
        for service in self._node.services:
            service.callback = self._wrap_callback(service.srv_name, service.callback)
            service.send_response = self._wrap_send(service.srv_name, service.send_response)

    def _wrap_callback(self, name: str, callback: Callable[..., Any]) -> Callable[..., _Answer]:
        own = callback.__module__.startswith('mlmem_ros')
        # rclpy's own raise these too: a transition not available now, a parameter of unknown type
        rclpy_errors = () if own else (rclpy_implementation.RCLError, ValueError, TypeError)

        async def serve_request(request: Any, response: Any) -> Any:
            try:
                if own:
                    await self.wait_while_held()
                answer = callback(request, response)
                return await answer if inspect.isawaitable(answer) else answer
            except Exception as error:
                if isinstance(error, (*REFUSALS, *rclpy_errors)):
                    self._log.refused(name, error)
                else:
                    self._log.exception(name, error)
                return _build_error_response(request, response, error, own)

        return lambda request, response: _Answer(serve_request(request, response))

    def _wrap_send(self, name: str, send: Callable[..., None]) -> Callable[..., None]:
        def send_answer(answer: _Answer, header: Any) -> None:
            def try_send(response: Any, again: Sequence[float] = RESEND_DELAYS_S) -> None:
                begun = time.monotonic()
                with self._log.guard_errors(name), suppress(InvalidHandle):  # after the node's end
                    send(response, header)
                # rmw_fastrtps waits 0.1 s for the client's reader, then drops the answer
                if again and time.monotonic() - begun > 0.09:
                    threading.Timer(again[0], try_send, (response, again[1:])).start()
                    return
                self.waiting.discard(id(answer))

            self.waiting.add(id(answer))
            answer.run(try_send)

        return send_answer


def _build_error_response(request: Any, response: Any, error: Exception, own: bool) -> Any:
    """Return a response that says why a request failed, as far as its type allows.

    Services of our `own` answer with a JSON object.
    """
    why = f'{error}' or type(error).__name__
    reason = answers.format_refusal(error) if own else why
    failed = SetParametersResult(successful=False, reason=reason)
    if hasattr(response, 'results') and hasattr(request, 'parameters'):  # as many as requested
        response.results += [failed] * (len(request.parameters) - len(response.results))
    elif isinstance(getattr(response, 'result', None), SetParametersResult):
        response.result = failed
    elif hasattr(getattr(response, 'result', None), 'error_message'):  # of a simulator
        # 4: RESULT_OPERATION_FAILED of simulation_interfaces/msg/Result
        response.result.result, response.result.error_message = 4, why
    elif hasattr(response, 'result'):  # of an action
        response.status = GoalStatus.STATUS_ABORTED
        response.result.error_code, response.result.error = response.result.FAILED, why
    elif hasattr(response, 'message'):
        response.success = False
        response.message = reason
    elif hasattr(response, 'success'):
        response.success = False
    elif hasattr(response, 'status'):
        response.status = [
            DiagnosticStatus(level=DiagnosticStatus.ERROR, name='self_test', message=why)
        ]
    return response
