# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A pending request: a future that can be awaited, in rclpy and asyncio, or waited for."""

from __future__ import annotations

import asyncio
import math
import time
from collections import deque
from collections.abc import AsyncGenerator, Callable, Generator, Mapping, Sequence
from concurrent.futures import CancelledError, Future, InvalidStateError
from concurrent.futures import TimeoutError as NotYet
from contextlib import suppress
from numbers import Real
from typing import Any, TypeVar
from uuid import uuid4

from action_msgs.msg import GoalInfo
from action_msgs.srv import CancelGoal
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.executors import Executor
from rclpy.node import Node
from rclpy.task import Future as RclpyFuture
from rclpy.timer import Timer
from unique_identifier_msgs.msg import UUID

from mlmem.schema import short_repr

from ...contract.answers import NoAnswer, RequestError, RequestRefused, parse_result
from ..middleware import DESTROYED_ERRORS, NOT_SERVING
from .connection import CHECK_PERIOD_S, NodeConnection

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

    Attributes:
        due: When the client's thread resumes the request, on the monotonic clock; infinite once it
            is over.
    """

    def __init__(
        self,
        connection: NodeConnection,
        what: str,
        steps: Callable[[Any], Steps[T]],
        timeout: float,
        patience: float | None = None,
    ) -> None:
        """Begin to ask for `what`, with a time-out in seconds for all of it, and with another
        patience than the connection's if given. The steps are given this reply.
        """
        super().__init__()
        self._connection, self._what = connection, what
        self._timeout = check_seconds('timeout', timeout)
        self._patience = min(connection.patience if patience is None else patience, timeout)
        self.due = self._begun = time.monotonic()
        self._deadline = self._begun + timeout  # later, if the node prepares meanwhile
        self._is_sent = False  # whether the node may have begun with it
        self._steps: Steps[T] = steps(self)
        connection.thread.post(self._start_steps)

    def wait(self) -> T:
        """Block this thread until the answer comes, and return it.

        A thread of the client's own takes the answer. So this works whether or not anybody spins
        the node, even in a callback.

        Raises:
            RequestError: There is no answer, or it reports an error.
            RuntimeError: This is the client's own thread, in which callbacks of the reply run if
                the node has no executor.
        """
        if self._connection.thread.is_current_thread and not self.done():
            raise RuntimeError('this thread takes the answers: await the reply, or wait elsewhere')
        while not self.done():
            with suppress(NotYet):
                self.exception(0.1)  # then look for signals, which another thread may have got
        return self.result()

    def __await__(self) -> Generator[Any, None, T]:
        """Suspend the coroutine, of rclpy or asyncio, until the answer comes."""
        if not self.done():
            suspension = Suspension(self._connection.node)
            super().add_done_callback(suspension.resume)
            try:
                yield from suspension.__await__()
            except asyncio.CancelledError:  # as of `asyncio.wrap_future`
                self.cancel()
                raise
        return self.result()

    def cancel(self) -> bool:
        """Give up the answer, as other futures do. The node cancels a procedure that was requested
        by an action; others go on until `MemoryClient.abort` stops them.
        """
        cancelled = super().cancel() and not self.set_running_or_notify_cancel()
        self._connection.thread.post(self.resume)
        return cancelled

    def add_done_callback(self, fn: Callable[[Future[T]], object]) -> None:
        """Have a function called with the reply: by the executor of the robot's node, if it has
        one, or else in the thread that takes the answer.
        """
        executor = self._connection.node.executor
        if executor is None:
            super().add_done_callback(fn)
        else:
            super().add_done_callback(lambda _: executor.create_task(fn, self))

    # --- in the client's thread -------------------------------------------------------------

    def _start_steps(self) -> None:
        """Send it, or wait until that is possible."""
        self._connection.thread.watch_request(self)
        self.resume()

    def resume(self, _: Any = None) -> None:
        """Go on, if what it waits for has come, is late or is hopeless."""
        now = time.monotonic()
        if self.due == math.inf:
            return
        try:
            if now > self._deadline:
                raise self._describe_timeout()
            if self.cancelled() and not self._is_sent:
                raise CancelledError
            if self._connection.find_end():
                raise self._describe_end()
            self.due = now + max(min(next(self._steps), self._deadline - now), 0.0)
        except StopIteration as end:
            self._end_request(end.value)
        except Exception as error:  # for the caller
            known = isinstance(error, RequestError) or not self._connection.find_end()
            self._end_request(error if known else self._describe_end())

    def wait_for(self, futures: Sequence[Future[Any]]) -> Steps[None]:
        """Wait until all futures are done."""
        for each in futures:
            Future.add_done_callback(each, lambda _: self._connection.thread.post(self.resume))
        while not all(each.done() for each in futures):
            yield math.inf

    def call(self, service: str, kind: Any, message: Any = None) -> Steps[Any]:
        """Call a service below the memory node's name; return its response.

        Without a message, wait until the service is available.

        Raises:
            NoAnswer: It is not available within the patience, or the node went away.
        """
        connection, begun = self._connection, time.monotonic()
        while not (client := connection.get_client(service, kind)).service_is_ready():
            if time.monotonic() - begun > self._patience:
                raise NoAnswer(
                    f'no memory node answers as {connection.peer} within {self._patience:g} s; '
                    'start one with "ros2 run mlmem_ros memory_node", and check ROS_DOMAIN_ID and '
                    'the name'
                )
            yield from self._wait_for_node(0.02)  # no event tells of new services
        if message is None:  # DDS drops messages without a reader
            return None
        self._is_sent, hidden = True, connection.hidden
        response = client.call_async(message)
        response.add_done_callback(self.resume)
        ready = time.monotonic()
        try:
            while not response.done():
                yield from self._wait_for_node(CHECK_PERIOD_S)
                now = time.monotonic()
                ready = now if client.service_is_ready() else ready
                away = now - ready > 1.0  # longer than the graph may take
                if away or connection.is_silent() or connection.hidden is not hidden:
                    raise NoAnswer(
                        f'{connection.peer} went away during {self._what}: how it ended is not '
                        'known'
                    )
            return response.result()
        finally:
            client.remove_pending_request(response)

    def _wait_for_node(self, period: float) -> Steps[None]:
        """Wait for at most a period; time in which the node prepares does not count."""
        begun = time.monotonic()
        yield period
        if not self.done():
            self._connection.report_wait(self._what, self._begun)
            if self._connection.status.level == NOT_SERVING:
                self._deadline += time.monotonic() - begun

    def _describe_timeout(self) -> NoAnswer:
        late = f'did not answer {self._what} within {self._timeout:g} s'
        why = f': {held_up}' if (held_up := self._connection.status.message) else ''
        return NoAnswer(f'{self._connection.peer} {late}{why}')

    def _describe_end(self) -> NoAnswer:
        end = self._connection.find_end()
        return NoAnswer(f'{self._connection.peer}: {end} during {self._what}')

    def _end_request(self, outcome: Any) -> None:
        """End for good, with an answer or an error, unless the answer was given up."""
        self.due = math.inf
        self._steps.close()
        with suppress(InvalidStateError):
            if isinstance(outcome, Exception):
                self.set_exception(outcome)
            else:
                self.set_result(outcome)


class ProcedureReply(Reply[T]):
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
        connection: NodeConnection,
        name: str,
        action: Any,
        arguments: Mapping[str, Any],
        kind: type[Any],
        service: Callable[[Reply[Any]], Steps[T]],
        timeout: float,
        what: str = '',
    ) -> None:
        """Wait for the node; then ask for its action, or else its service."""
        self._path, self._action = f'{name}/_action', action
        self._number = UUID(uuid=list(uuid4().bytes))
        self._accepted = self._unwanted = False
        goal = action and action.Goal(**arguments)

        def run_goal(reply: Reply[T]) -> Steps[T]:
            yield from reply.call('request', SetParametersAtomically)
            if not self._is_goal():
                return (yield from service(reply))
            impl = action.Impl
            message = impl.SendGoalService.Request(goal_id=self._number, goal=goal)
            path = f'{self._path}/send_goal'
            if not (yield from reply.call(path, impl.SendGoalService, message)).accepted:
                raise RequestRefused({'error': 'the node already has a goal with this id'})
            self._accepted = True
            if self._unwanted:
                self._cancel_goal()
            message = impl.GetResultService.Request(goal_id=self._number)
            path = f'{self._path}/get_result'
            response = yield from reply.call(path, impl.GetResultService, message)
            answer: T = parse_result(name, kind, response.result, goal)
            return answer

        super().__init__(connection, what or name, run_goal, timeout)

    def cancel_goal(self) -> bool:
        """Make the node stop this procedure, and nothing else, and release the strain.

        The reply then raises `RequestFailed`, once the strain is zero.

        Returns:
            Whether that is possible. Once it was requested without actions it is not;
            `MemoryClient.abort` stops whatever runs.
        """
        if self._action is None or self.done():
            return False
        self._connection.thread.post(self._cancel_goal)
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
        suspensions: list[Suspension] = []

        def wake_waiter(_: Any = None) -> None:
            while suspensions:
                suspensions.pop().resume()

        def take_message(message: Any) -> None:
            if message.goal_id == self._number:
                feedback.append(message.feedback)
                wake_waiter()

        def subscribe() -> None:
            path, kind = f'{self._path}/feedback', self._action.Impl.FeedbackMessage
            receivers = self._connection.get_receivers(path, kind)
            receivers.add(take_message)
            Future.add_done_callback(self, lambda _: receivers.discard(take_message))

        self._connection.thread.post(subscribe)
        Future.add_done_callback(self, wake_waiter)
        while feedback or not self.done():
            if feedback:
                yield feedback.popleft()
                continue
            suspensions.append(suspension := Suspension(self._connection.node))
            if not (feedback or self.done()):  # nothing has come meanwhile
                await suspension

    # --- in the client's thread -------------------------------------------------------------

    def _is_goal(self) -> bool:
        """Return whether the node serves the action."""
        if self._unwanted:
            raise RequestRefused({'error': f'{self._what} was canceled before it was sent'})
        if not self._connection.has_service(f'{self._path}/send_goal'):
            self._action = None
        return self._action is not None

    def _cancel_goal(self) -> None:
        """Ask the node to cancel the goal once it was accepted; its result says how it ended."""
        self._unwanted = True
        if not self._accepted:
            return
        message = CancelGoal.Request(goal_info=GoalInfo(goal_id=self._number))

        def send_cancel(reply: Reply[Any]) -> Steps[Any]:
            return (yield from reply.call(f'{self._path}/cancel_goal', CancelGoal, message))

        Reply(self._connection, f'cancel {self._what}', send_cancel, timeout=60.0)


class Suspension:
    """Suspends a coroutine, of rclpy or asyncio, until another thread resumes it."""

    def __init__(self, node: Node) -> None:
        """Suspend one that runs in asyncio's loop, or else in the executor of a node."""
        self._node = node
        self._future: Any
        try:
            self._loop = asyncio.get_running_loop()
            self._future = self._loop.create_future()
        except RuntimeError:  # an executor runs the coroutine
            self._future = RclpyFuture(executor=node.executor)

    def resume(self, _: Any = None) -> None:
        """Have it go on; from any thread."""
        if isinstance(self._future, RclpyFuture):
            self._future.set_result(None)
        else:
            with suppress(RuntimeError):  # the loop is closed
                self._loop.call_soon_threadsafe(self._resume_future)
        wake_executor(self._node)

    def _resume_future(self) -> None:
        if not self._future.done():  # or cancelled with its task
            self._future.set_result(None)

    def __await__(self) -> Generator[Any, None, None]:
        while not self._future.done():  # an executor that asyncio spins resumes it earlier
            self._future._asyncio_future_blocking = True
            yield self._future


def wake_executor(node: Node) -> None:
    """Have the executor of a node, if there is one, resume its coroutines.

    The executor of events does so only after a callback of the node, and takes no guard condition.
    """
    executor = node.executor
    if isinstance(executor, Executor):
        executor.wake()
    elif executor is not None:
        with suppress(*DESTROYED_ERRORS):
            timers: list[Timer] = []  # it may fire before it is in here, and then fires again

            def destroy_timers() -> None:
                while timers:
                    node.destroy_timer(timers.pop())

            timers.append(node.create_timer(0.0, destroy_timers))


def check_seconds(name: str, value: Any) -> float:
    """Return a time above 0.

    Raises:
        ValueError: It is none.
    """
    if isinstance(value, bool) or not isinstance(value, Real) or not float(value) > 0.0:
        raise ValueError(f'{name} must be above 0 s; got {short_repr(value)}')
    return float(value)
