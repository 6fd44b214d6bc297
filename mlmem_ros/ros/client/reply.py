# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A pending request: a future that can be awaited, in rclpy and asyncio, or waited for."""

from __future__ import annotations

import asyncio
import math
import threading
import time
from collections import deque
from collections.abc import AsyncGenerator, Awaitable, Callable, Generator, Mapping
from concurrent.futures import Future, InvalidStateError
from concurrent.futures import TimeoutError as NotYet
from contextlib import suppress
from dataclasses import dataclass
from numbers import Real
from typing import Any, NamedTuple, TypeVar
from uuid import uuid4

from action_msgs.msg import GoalInfo
from action_msgs.srv import CancelGoal
from diagnostic_msgs.msg import DiagnosticStatus
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.executors import Executor
from rclpy.node import Node
from rclpy.task import Future as RclpyFuture
from rclpy.timer import Timer
from unique_identifier_msgs.msg import UUID

from mlmem.schema import short_repr

from ...contract.answers import ANSWER_TYPES, Decoded, NoAnswer, RequestRefused, parse_result
from ..middleware import DESTROYED_ERRORS
from .connection import ClientThread, MemoryLink

T = TypeVar('T')

Steps = Generator[float, None, T]
"""What leads to an answer: it yields the seconds to wait at most, and may be resumed earlier."""


class Reply(Future[T]):
    """The future answer to a request, which is sent when the reply is created.

    In a coroutine, such as an `async def` callback or one of asyncio, await it::

        async def on_button(self, _):
            content = await self.memory.write(5)

    The executor runs other callbacks meanwhile, except those of the same callback group:
    `MemoryClient.group` is one for callbacks that await. Anywhere else, wait for it::

        content = client.write(5).wait()

    or attach `add_done_callback`. Either way the result is the answer, or a `RequestError` is
    raised. It is a `concurrent.futures.Future`, so `concurrent.futures.wait` takes several.
    """

    def __init__(self, node: Node) -> None:
        """Make the reply to a request of a robot's node."""
        super().__init__()
        self._node = node

    def wait(self) -> T:
        """Block this thread until the answer comes, and return it.

        A thread of the client's own takes the answer. So this works whether or not anybody spins
        the node, even in a callback.

        Raises:
            RequestError: There is no answer, or it reports an error.
            RuntimeError: This is the client's own thread, in which callbacks run of `standalone`,
                and of replies if the node has no executor.
        """
        if isinstance(threading.current_thread(), ClientThread) and not self.done():
            raise RuntimeError('this thread takes the answers: await the reply, or wait elsewhere')
        while not self.done():
            with suppress(NotYet):
                self.exception(0.1)  # then look for signals, which another thread may have got
        return self.result()

    def __await__(self) -> Generator[Any, None, T]:
        """Suspend the coroutine, of rclpy or asyncio, until the answer comes."""
        return self._await_answer().__await__()

    async def _await_answer(self) -> T:
        if not self.done():
            wait, resume = create_suspension(self._node)
            super().add_done_callback(lambda _: resume())
            try:
                await wait()
            except asyncio.CancelledError:  # as of `asyncio.wrap_future`
                self.cancel()
                raise
        return self.result()

    def cancel(self) -> bool:
        """Give up the answer, as other futures do.

        The node cancels a procedure that was requested by an action; others go on until
        `MemoryClient.abort` stops them.
        """
        return super().cancel() and not self.set_running_or_notify_cancel()

    def add_done_callback(self, fn: Callable[[Future[T]], object]) -> None:
        """Have a function called with the reply: by the executor of the robot's node, if it has
        one, or else in the thread that takes the answer.
        """
        executor = self._node.executor
        if executor is None:
            super().add_done_callback(fn)
        else:
            super().add_done_callback(lambda _: executor.create_task(fn, self))

    def settle(self, outcome: T | Exception) -> None:
        """End with a result or an error, unless it has ended or was given up."""
        with suppress(InvalidStateError):
            if isinstance(outcome, Exception):
                self.set_exception(outcome)
            else:
                self.set_result(outcome)


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
        self._peer, self._what, self._call = peer, what, call
        self._timeout = check_timeout(timeout)
        self.due = self._begun = time.monotonic()  # later, if the node prepares meanwhile
        self._is_found = self._is_unwanted = False
        self._steps: Steps[T] = self._run_steps()
        try:
            ClientThread.connect_request(self, peer.node.context, peer.name)
        except Exception:
            if peer.node.context.ok():
                raise
            self.settle(self._describe_shutdown())
        else:
            self.link.thread.post(self.resume)

    def cancel(self) -> bool:
        """Give up the answer, as other futures do, and do not send what is not sent yet."""
        self._is_unwanted = True
        return super().cancel()

    # --- in the client's thread -------------------------------------------------------------

    def resume(self, _: Any = None) -> None:
        """Go on, if what it waits for has come, is late or is hopeless."""
        if self.due == math.inf:
            return
        try:
            now = time.monotonic()
            limit = self._timeout if self._is_found else min(self._peer.patience, self._timeout)
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
        answer: T = parse((yield from self._call_service(service, kind, message)))
        return answer

    def _call_service(self, service: str, kind: Any, message: Any = None) -> Steps[Any]:
        """Call a service; return its response. Without a message, wait until it is available.

        Raises:
            NoAnswer: The node went away.
            RequestRefused: The request was canceled before it could be sent.
        """
        client = self.link.get_client(service, kind)
        while not client.service_is_ready():  # DDS drops messages without a reader
            yield from self._wait_for_node(0.02)  # no event tells of new services
        self.link.expect_heartbeat()
        if self._is_unwanted and not self._is_found:
            raise RequestRefused({'error': f'{self._what} was canceled before it was sent'})
        self._is_found = True
        if message is None:
            return None
        response = client.call_async(message)
        response.add_done_callback(self.resume)
        try:
            while not response.done():
                yield from self._wait_for_node(0.5)
                if self.link.is_silent() and not response.done():
                    raise NoAnswer(
                        f'{self._peer.name} went away during {self._what}: how it ended is not '
                        'known'
                    )
            return response.result()
        finally:
            client.remove_pending_request(response)

    def _wait_for_node(self, period: float) -> Steps[None]:
        """Wait for at most a period; time in which the node prepares does not count."""
        begun = time.monotonic()
        yield period
        status = self.link.status
        if status.level == DiagnosticStatus.STALE:
            self._begun += time.monotonic() - begun
        if status.message != self.link.reported:
            self.link.reported = status.message
            if status.message:
                text = f'{self._what} waits for {self._peer.name}: {status.message}'
                self._node.get_logger().info(text)

    def _describe_timeout(self, limit: float) -> NoAnswer:
        if not self._is_found:
            return NoAnswer(
                f'no memory node answers as {self._peer.name} within {limit:g} s; start one with '
                '"ros2 run mlmem_ros memory_node", and check ROS_DOMAIN_ID and the name'
            )
        why = f': {held_up}' if (held_up := self.link.status.message) else ''
        return NoAnswer(f'{self._peer.name} did not answer {self._what} within {limit:g} s{why}')

    def _describe_shutdown(self) -> NoAnswer:
        return NoAnswer(f'{self._peer.name}: ROS was shut down during {self._what}')


class ProcedureReply(ServiceReply[T]):
    """A requested procedure: a goal of the node's action if there is one, else a service call.

    Use it like any reply. If the node serves actions, it gives feedback meanwhile::

        goal = self.memory.write(5)
        async for feedback in goal:
            self.get_logger().info(f'{feedback.phase} {feedback.share:.0%}')
        content = await goal

    It speaks an action's protocol by its services: an `ActionClient` of rclpy adds a topic per
    procedure, and cannot drop a pending request.
    """

    def __init__(
        self,
        peer: Peer,
        what: str,
        call: ServiceCall,
        timeout: float,
        name: str,
        action: Any,
        arguments: Mapping[str, Any],
    ) -> None:
        """Send a goal with arguments to the action of a procedure, or call a service.

        Args:
            name: Name of the procedure.
            action: Its type of action; None for the service.
        """
        self._name, self._action = name, action
        self._goal = action and action.Goal(**arguments)
        self._id = UUID(uuid=list(uuid4().bytes))
        self._is_accepted = False
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
        """Yield the node's feedback; what came before the first wait is lost."""
        if self._action is None:
            return
        feedback: deque[Any] = deque()
        wait, resume = create_suspension(self._node)

        def take_feedback(message: Any) -> None:
            feedback.append(message)
            resume()

        receivers, key = self.link.receivers, bytes(self._id.uuid)
        receivers[key] = take_feedback
        topic, kind = f'{self._name}/_action/feedback', self._action.Impl.FeedbackMessage
        self.link.thread.post(lambda: self.link.subscribe_feedback(topic, kind))
        Future.add_done_callback(self, lambda _: receivers.pop(key))
        Future.add_done_callback(self, lambda _: resume())
        while feedback or not self.done():
            await wait()
            wait, resume = create_suspension(self._node)
            while feedback:
                yield feedback.popleft()

    # --- in the client's thread -------------------------------------------------------------

    def _run_steps(self) -> Steps[T]:
        yield from self._call_service('request', SetParametersAtomically)
        path = f'{self._name}/_action'
        if not self.link.has_service(f'{path}/send_goal'):
            self._action = None
        if self._action is None:
            return (yield from super()._run_steps())
        impl = self._action.Impl
        message = impl.SendGoalService.Request(goal_id=self._id, goal=self._goal)
        sent = yield from self._call_service(f'{path}/send_goal', impl.SendGoalService, message)
        if not sent.accepted:
            raise RequestRefused({'error': 'the node already has a goal with this id'})
        self._is_accepted = True
        if self._is_unwanted:
            self._cancel_goal()
        message = impl.GetResultService.Request(goal_id=self._id)
        ended = yield from self._call_service(f'{path}/get_result', impl.GetResultService, message)
        kind: Any = ANSWER_TYPES.get(self._name, Decoded)
        answer: T = parse_result(self._name, kind, ended.result, self._goal)
        return answer

    def _cancel_goal(self) -> None:
        """Ask the node to cancel the goal once it was accepted; its result says how it ended."""
        self._is_unwanted = True
        if self._is_accepted:
            service = f'{self._name}/_action/cancel_goal'
            message = CancelGoal.Request(goal_info=GoalInfo(goal_id=self._id))
            call = ServiceCall(service, CancelGoal, message, lambda _: None)
            ServiceReply[None](self._peer, f'cancel {self._what}', call, timeout=60.0)


def create_suspension(
    node: Node,
) -> tuple[Callable[[], Awaitable[object]], Callable[[], None]]:
    """Return by which functions a coroutine, of asyncio or else of a node's executor, waits, and
    another thread resumes it.
    """
    try:
        loop, resumed = asyncio.get_running_loop(), asyncio.Event()
    except RuntimeError:  # an executor runs the coroutine
        future = RclpyFuture(executor=node.executor)

        def resume_task() -> None:
            future.set_result(None)
            wake_executor(node)

        return lambda: future, resume_task

    def resume_in_loop() -> None:
        with suppress(RuntimeError):  # the loop is closed
            loop.call_soon_threadsafe(resumed.set)

    return resumed.wait, resume_in_loop


def wake_executor(node: Node) -> None:
    """Have the executor of a node, if there is one, resume its coroutines.

    The executor of events does so only after a callback of the node, and takes no guard condition.
    """
    executor = node.executor
    if isinstance(executor, Executor):
        executor.wake()
    elif executor is not None:
        with suppress(*DESTROYED_ERRORS):
            timer: Timer = node.create_timer(
                0.0, lambda: node.destroy_timer(timer), autostart=False
            )
            timer.reset()


def check_timeout(value: Any) -> float:
    """Return a time-out in seconds.

    Raises:
        ValueError: It is not above 0.
    """
    if isinstance(value, bool) or not isinstance(value, Real) or not float(value) > 0.0:
        raise ValueError(f'timeout must be above 0 s; got {short_repr(value)}')
    return float(value)
