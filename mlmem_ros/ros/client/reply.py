# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The future answer to a request, which can be awaited, in rclpy and asyncio, or waited for; and
the request to a memory node behind it, by rclpy's clients, in a client's thread.
"""

from __future__ import annotations

import asyncio
import math
import threading
import time
from collections import deque
from collections.abc import AsyncGenerator, Awaitable, Callable, Generator
from concurrent.futures import Future, InvalidStateError
from concurrent.futures import TimeoutError as NotYet
from contextlib import suppress
from numbers import Real
from typing import Any, NamedTuple, TypeVar

from diagnostic_msgs.msg import DiagnosticStatus
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.action.client import ClientGoalHandle
from rclpy.executors import Executor
from rclpy.node import Node
from rclpy.task import Future as RclpyFuture
from rclpy.timer import Timer

from mlmem.schema import short_repr

from ...contract.answers import ANSWER_TYPES, Decoded, NoAnswer, RequestRefused, parse_result
from ..middleware import DESTROYED_ERRORS
from .connection import CLIENT_THREAD_NAME, ClientThread, MemoryLink

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
        if threading.current_thread().name == CLIENT_THREAD_NAME and not self.done():
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
            waiting, resume = create_suspension(self._node)
            super().add_done_callback(resume)
            try:
                await waiting
            except asyncio.CancelledError:  # as of `asyncio.wrap_future`
                self.cancel()
                raise
        return self.result()

    def cancel(self) -> bool:
        """Give up the answer, as other futures do.

        The node cancels a procedure that was requested by an action; others go on until
        `MemoryClient.abort` stops them.
        """
        if not self.cancelled() and super().cancel():
            self.set_running_or_notify_cancel()  # whoever waits for several replies
        return self.cancelled()

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


class ServiceCall(NamedTuple):
    """A call of a service, named below its node, and what makes the answer of its response.

    Without a message, it only waits until the service is available.
    """

    service: str
    kind: Any
    message: Any
    parse: Callable[[Any], Any]


class ActionCall(NamedTuple):
    """A goal of an action, named like the procedure that it requests."""

    action: str
    kind: Any
    goal: Any


class RequestReply(Reply[T]):
    """The reply to a request to a memory node.

    A procedure is a goal of the node's action if there is one, else a service call. If the node
    serves actions, it gives feedback meanwhile::

        goal = self.memory.write(5)
        async for feedback in goal:
            self.get_logger().info(f'{feedback.phase} {feedback.share:.0%}')
        content = await goal

    Attributes:
        due: When the client's thread resumes the request, on the monotonic clock; infinite once it
            is over.
        link: The link through which it goes.
    """

    link: MemoryLink

    def __init__(
        self,
        node: Node,
        peer: str,
        what: str,
        call: ServiceCall,
        timeout: float,
        patience: float,
        action: ActionCall | None = None,
    ) -> None:
        """Begin to ask for `what`, in words.

        Args:
            node: The robot's node.
            peer: Full name of the memory node.
            timeout: Most seconds for all of it.
            patience: Most seconds of these until the memory node appears.
            action: What is sent in place of the call if the memory node serves the action.
        """
        super().__init__(node)
        self._peer, self._what, self._call, self._action = peer, what, call, action
        self._timeout = check_timeout(timeout)
        self._patience = min(patience, timeout)
        self.due = self._begun = time.monotonic()  # later, if the node prepares meanwhile
        self._is_found = self._is_unwanted = False
        self._handle: ClientGoalHandle | None = None
        self._feedback: deque[Any] = deque(maxlen=100)
        self._resume_iteration: Callable[[object], None] = lambda _: None
        self._steps: Steps[T] = self._run_steps()
        try:
            ClientThread.accept(self, node.context, peer)
        except Exception:
            if node.context.ok():
                raise
            self.settle(self._describe_shutdown())

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
        """Give up the answer, as other futures do; cancel its goal, and do not send what is not
        sent yet.
        """
        self._is_unwanted = True
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
        if self._action is not None:
            last = self.link.get_client('request', SetParametersAtomically)  # after the actions
            yield from self._find_server(last.service_is_ready)
            if self.link.serves_action(self._action.action):
                return (yield from self._run_action(*self._action))
            self._action = None
            self._resume_iteration(None)
        service, kind, message, parse = self._call
        client = self.link.get_client(service, kind)
        yield from self._find_server(client.service_is_ready)
        response = message and (yield from self._await_response(client.call_async(message)))
        answer: T = parse(response)
        return answer

    def _run_action(self, name: str, kind: Any, goal: Any) -> Steps[T]:
        client = self.link.get_action_client(name, kind)
        yield from self._find_server(client.server_is_ready)
        sent = client.send_goal_async(goal, self._take_feedback)
        self._handle = yield from self._await_response(sent)
        if not self._handle.accepted:
            raise RequestRefused({'error': f'{self._peer} did not accept the goal'})
        if self._is_unwanted:
            self._cancel_goal()
        ended = yield from self._await_response(self._handle.get_result_async())
        answer_type: Any = ANSWER_TYPES.get(name, Decoded)
        answer: T = parse_result(name, answer_type, ended.result, goal)
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


def create_suspension(node: Node) -> tuple[Awaitable[object], Callable[[object], None]]:
    """Return what a coroutine, of asyncio or else of an executor, awaits, and the function by
    which another thread resumes it.

    A task of rclpy 7.1.9 and later refuses a future of another executor than its own; one without
    an executor it takes over. Before, a task is resumed when its executor wakes next, so the node
    of the client should be in the same one.
    """
    executor = node.executor
    try:
        loop = asyncio.get_running_loop()
    except RuntimeError:  # an executor runs the coroutine
        task_future = RclpyFuture()

        def resume_task(_: object) -> None:
            task_future.set_result(None)
            if isinstance(executor, Executor):
                executor.wake()
            elif executor is not None:  # one of events resumes only after a callback of the node
                with suppress(*DESTROYED_ERRORS):
                    timer: Timer = node.create_timer(
                        0.0, lambda: node.destroy_timer(timer), autostart=False
                    )
                    timer.reset()

        return task_future, resume_task
    future = loop.create_future()

    def end_waiting() -> None:
        if not future.done():
            future.set_result(None)

    def resume_in_loop(_: object) -> None:
        with suppress(RuntimeError):  # the loop is closed
            loop.call_soon_threadsafe(end_waiting)

    return future, resume_in_loop
