# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Requests to a memory node, by rclpy's clients of services and actions, in a client's thread."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import AsyncGenerator, Callable, Generator
from concurrent.futures import Future
from dataclasses import dataclass
from numbers import Real
from typing import Any, NamedTuple, TypeVar

from diagnostic_msgs.msg import DiagnosticStatus
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.action.client import ClientGoalHandle
from rclpy.node import Node
from rclpy.task import Future as RclpyFuture

from mlmem.schema import short_repr

from ...contract.answers import ANSWER_TYPES, Decoded, NoAnswer, RequestRefused, parse_result
from ..middleware import DESTROYED_ERRORS
from .connection import ClientThread, MemoryLink
from .reply import Reply, create_suspension

T = TypeVar('T')

Steps = Generator[float, None, T]
"""What leads to an answer: it yields the seconds to wait at most, and may be resumed earlier."""


@dataclass(frozen=True)
class Peer:
    """A memory node by its full name, a robot's node, and how long the robot waits in seconds for
    the memory node to appear.
    """

    node: Node
    name: str
    patience: float


class ServiceCall(NamedTuple):
    """A call of a service, named below its node, and what makes the answer of its response.

    Without a message, it only waits until the service is available.
    """

    service: str
    kind: Any
    message: Any
    parse: Callable[[Any], Any]


class ServiceReply(Reply[T]):
    """The reply to a call of a service.

    Attributes:
        due: When the client's thread resumes the request, on the monotonic clock; infinite once it
            is over.
        link: The link through which it goes.
    """

    link: MemoryLink

    def __init__(self, peer: Peer, what: str, call: ServiceCall, timeout: float) -> None:
        """Begin to ask for `what`, with a time-out in seconds for all of it."""
        super().__init__(peer.node)
        self._peer, self._what, self._call = peer.name, what, call
        self._timeout = check_timeout(timeout)
        self._patience = min(peer.patience, timeout)
        self.due = self._begun = time.monotonic()  # later, if the node prepares meanwhile
        self._is_found = self._is_unwanted = False
        self._steps: Steps[T] = self._run_steps()
        try:
            ClientThread.accept(self, peer.node.context, peer.name)
        except Exception:
            if peer.node.context.ok():
                raise
            self.settle(self._describe_shutdown())

    def cancel(self) -> bool:
        """Give up the answer, as other futures do, and do not send what is not sent yet."""
        self._is_unwanted = True
        return super().cancel()

    # --- in the client's thread -------------------------------------------------------------

    def resume(self, _: object = None) -> None:
        """Go on, if what it waits for has come, is late or is hopeless."""
        if self.due == math.inf:
            return
        try:
            now = time.monotonic()
            limit = self._timeout if self._is_found else self._patience
            if self.link.thread.closed:
                raise self._describe_shutdown()
            if now > self._begun + limit:
                raise self._describe_timeout(limit)
            self.due = now + min(next(self._steps), max(self._begun + limit - now, 0.0))
        except StopIteration as end:
            self._end_request(end.value)
        except DESTROYED_ERRORS:
            self._end_request(self._describe_shutdown())
        except Exception as error:  # for the caller
            self._end_request(error)

    def _end_request(self, outcome: T | Exception) -> None:
        self.due = math.inf
        self.link.thread.requests.discard(self)
        self._steps.close()
        self.settle(outcome)

    def _run_steps(self) -> Steps[T]:
        service, kind, message, parse = self._call
        client = self.link.get_client(service, kind)
        yield from self._find_server(client.service_is_ready)
        response = message and (yield from self._await_response(client.call_async(message)))
        answer: T = parse(response)
        return answer

    def _find_server(self, is_ready: Callable[[], bool]) -> Steps[None]:
        """Wait until the memory node is there, since DDS drops messages without a reader.

        Raises:
            RequestRefused: The request was canceled before it could be sent.
        """
        while not is_ready():
            yield from self._wait_for_node(0.02)  # no event tells of new services
        self.link.expect_heartbeat()
        if self._is_unwanted and not self._is_found:
            raise RequestRefused({'error': f'{self._what} was canceled before it was sent'})
        self._is_found = True

    def _await_response(self, response: RclpyFuture) -> Steps[Any]:
        """Wait for a response; return it.

        Raises:
            NoAnswer: The node went away.
        """
        response.add_done_callback(self.resume)
        try:
            while not response.done():
                yield from self._wait_for_node(0.5)
                if self.link.is_silent() and not response.done():
                    raise NoAnswer(
                        f'{self._peer} went away during {self._what}: how it ended is not known'
                    )
            return response.result()
        finally:
            response.remove_done_callback(self.resume)
            response.cancel()  # its client forgets it, if nothing has come

    def _wait_for_node(self, period: float) -> Steps[None]:
        """Wait for at most a period; time in which the node prepares does not count."""
        begun = time.monotonic()
        yield period
        status = self.link.status
        if status.level == DiagnosticStatus.STALE and not self.link.is_silent():
            self._begun += time.monotonic() - begun
        if status.message != self.link.reported:
            self.link.reported = status.message
            if status.message:
                text = f'{self._what} waits for {self._peer}: {status.message}'
                self._node.get_logger().info(text)

    def _describe_timeout(self, limit: float) -> NoAnswer:
        if not self._is_found:
            return NoAnswer(
                f'no memory node answers as {self._peer} within {limit:g} s; start one with '
                '"ros2 run mlmem_ros memory_node", and check ROS_DOMAIN_ID and the name'
            )
        why = f': {held_up}' if (held_up := self.link.status.message) else ''
        return NoAnswer(f'{self._peer} did not answer {self._what} within {limit:g} s{why}')

    def _describe_shutdown(self) -> NoAnswer:
        return NoAnswer(f'{self._peer}: ROS was shut down during {self._what}')


class ProcedureReply(ServiceReply[T]):
    """A requested procedure: a goal of the node's action if there is one, else a service call.

    Use it like any reply. If the node serves actions, it gives feedback meanwhile::

        goal = self.memory.write(5)
        async for feedback in goal:
            self.get_logger().info(f'{feedback.phase} {feedback.share:.0%}')
        content = await goal
    """

    def __init__(
        self, peer: Peer, what: str, call: ServiceCall, timeout: float, action: Any, goal: Any
    ) -> None:
        """Send a goal to the action of this type, named by the first word of `what`; without one
        call the service.
        """
        self._action, self._goal = action, goal
        self._handle: ClientGoalHandle | None = None
        self._feedback: deque[Any] = deque(maxlen=100)
        self._resume_iteration: Callable[[object], None] = lambda _: None
        super().__init__(peer, what, call, timeout)

    def cancel_goal(self) -> bool:
        """Make the node stop this procedure, and nothing else, and release the strain.

        The reply then raises `RequestFailed`, once the strain is zero.

        Returns:
            Whether that is possible. Once it was requested without actions it is not;
            `MemoryClient.abort` stops whatever runs.
        """
        if self._action is None or self.done():
            return False
        self.link.thread.post(self._cancel_goal)
        return True

    def cancel(self) -> bool:
        """Give up the answer, and cancel the goal."""
        self.cancel_goal()
        return super().cancel()

    async def __aiter__(self) -> AsyncGenerator[Any, None]:
        """Yield the node's feedback."""
        Future.add_done_callback(self, lambda _: self._resume_iteration(None))
        while True:
            waiting, self._resume_iteration = create_suspension(self._node)
            while self._feedback:
                yield self._feedback.popleft()
            if self.done() or self._action is None:
                return
            await waiting

    # --- in the client's thread -------------------------------------------------------------

    def _run_steps(self) -> Steps[T]:
        last = self.link.get_client('request', SetParametersAtomically)  # served after the actions
        yield from self._find_server(last.service_is_ready)
        name = self._what.partition(' ')[0]
        if self._action is None or not self.link.serves_action(name):
            self._action = None
            self._resume_iteration(None)
            return (yield from super()._run_steps())
        client = self.link.get_action_client(name, self._action)
        yield from self._find_server(client.server_is_ready)
        sent = client.send_goal_async(self._goal, self._take_feedback)
        self._handle = yield from self._await_response(sent)
        if not self._handle.accepted:
            raise RequestRefused({'error': f'{self._peer} did not accept the goal'})
        if self._is_unwanted:
            self._cancel_goal()
        ended = yield from self._await_response(self._handle.get_result_async())
        answer_type: Any = ANSWER_TYPES.get(name, Decoded)
        answer: T = parse_result(name, answer_type, ended.result, self._goal)
        return answer

    def _take_feedback(self, message: Any) -> None:
        self._feedback.append(message.feedback)
        self._resume_iteration(None)

    def _cancel_goal(self) -> None:
        """Ask the node to cancel the goal once it was accepted; its result says how it ended."""
        self._is_unwanted = True
        if self._handle is not None:
            self._handle.cancel_goal_async()


def check_timeout(value: Any) -> float:
    """Return a time-out in seconds.

    Raises:
        ValueError: It is not above 0.
    """
    if isinstance(value, bool) or not isinstance(value, Real) or not float(value) > 0.0:
        raise ValueError(f'timeout must be above 0 s; got {short_repr(value)}')
    return float(value)
