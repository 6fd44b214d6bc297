# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A pending request: an rclpy future that can be awaited, or waited for."""

from __future__ import annotations

import asyncio
import contextlib
import threading
import time
from collections import deque
from collections.abc import Callable, Generator, Mapping, Sequence
from functools import partial
from numbers import Real
from types import coroutine
from typing import Any, Generic, TypeVar
from uuid import uuid4

from action_msgs.msg import GoalInfo
from action_msgs.srv import CancelGoal
from rclpy.exceptions import InvalidHandle
from rclpy.task import Future
from unique_identifier_msgs.msg import UUID

from ...clipped import clipped
from ...contract import calls
from ...contract.calls import NoAnswer, RequestRefused
from ...contract.services import fields
from .line import Call, Connection, Link

T = TypeVar('T')

GONE = 1.0
"""Seconds that a service may be missing from the graph before its answer is given up."""

SIGNALS = 0.1
"""Seconds after which a waiting thread looks for signals, which another thread may have got."""

LATE = 600.0
"""Seconds for which the end of a procedure is awaited whose answer was given up."""

MOST = 20
"""Most requests of a client that wait for one another."""

Steps = Generator[Call | Sequence[Future], Any, T]
"""A conversation: it yields a call and is sent the response, or yields futures and resumes when
all are done; it returns the result."""

End = Callable[[], None]
"""Settles a reply: with a result, with an error, or as cancelled."""


class Reply(Future, Generic[T]):
    """The future answer to a request, which is sent when the reply is created.

    In a coroutine, such as an `async def` callback or one of asyncio, await it::

        async def on_button(self, _):
            content = await self.memory.write(5)

    The executor runs other callbacks meanwhile, except those of the same callback group:
    `MemoryClient.group` is one for callbacks that await. Anywhere else, wait for it::

        content = client.write(5).wait()

    or attach `add_done_callback`. Either way the result is the answer, or a `RequestError` is
    raised. `cancel` gives up the answer; it does not stop the element, as `MemoryClient.abort`
    does.

    Attributes:
        settled: Done when this is, or cancelled; its callbacks run at once, in any thread.
        freed: Done when the node has nothing more to do with it, as far as is known: later, if
            the answer to a procedure was given up.
    """

    _lasting = False
    """Whether the conversation goes on if the answer is given up."""

    def __init__(
        self,
        connection: Connection,
        what: str,
        steps: Steps[T],
        timeout: float,
        patience: float | None = None,
    ) -> None:
        """Begin a conversation about `what`, with a time-out in seconds for all of it, and with
        another patience than the connection's if given.
        """
        super().__init__(executor=connection.node.executor)
        self._timeout = seconds('timeout', timeout)
        self._patience = min(connection.patience if patience is None else patience, timeout)
        self._connection, self._peer = connection, connection.peer
        self._what = what
        self._steps = steps
        self._step: Call | Sequence[Future] = ()
        self._sent: Future | None = None
        self._link: Link | None = None  # over which it was sent
        self._begun = self._asked = self._seen = time.monotonic()
        self._given = False  # or given up: the answer
        self._ended = False  # the conversation
        self._busy = False
        self._turn = threading.RLock()  # the asking thread and the line's may meet here
        self.settled = Future()
        self.freed = Future()
        self._arrived = threading.Event()  # wakes the waiting thread
        self._go_on()
        if not self._ended:
            connection.line.watch(self)

    def __await__(self) -> Generator[Any, None, T]:
        """Suspend the coroutine, of rclpy or asyncio, until the answer comes."""
        return self._awaited().__await__()

    async def _awaited(self) -> T:
        try:
            await _until(self, self.settled, self._connection)
        except asyncio.CancelledError:  # asyncio's time-outs end what they wait for
            self.cancel()
            raise
        return self._answer()

    def wait(self) -> T:
        """Block this thread until the answer comes, and return it.

        A thread of the client's own takes the answer. So this works whether or not anybody spins
        the node, even in a callback.

        Raises:
            RequestError: There is no answer, or it reports an error.
            RuntimeError: This is the client's own thread, in which callbacks of the reply run if
                the node has no executor.
        """
        if self._connection.line.here and not self._arrived.is_set():
            raise RuntimeError('this thread takes the answers: await the reply, or wait elsewhere')
        try:
            while not self._arrived.wait(SIGNALS):
                pass
        except BaseException:  # Ctrl-C: nobody will ask for the answer, nor complain of that
            self.settled.add_done_callback(lambda _: self.exception())
            raise
        return self._answer()

    def _answer(self) -> T:
        if self.cancelled():
            raise NoAnswer(f'{self._peer}: {self._what} was cancelled')
        answer: T = self.result()
        return answer

    def cancel(self) -> None:
        """Give up the answer."""
        self._settle(lambda: self._give_up(super(Reply, self).cancel))

    # --- going on, in whatever thread ------------------------------------------------------

    def look(self, now: float) -> bool:
        """Go on or give up, by clock and graph; return whether it is still pending."""
        self._settle(lambda: self._watch(now))
        return not self._ended

    def _go_on(self, _: Future | None = None) -> None:
        """Resume the conversation if what it waits for is there."""
        self._settle(self._next)

    def _settle(self, work: Callable[[], End | None]) -> None:
        """Do one thing at a time, and settle if that is the end; this without the lock, since
        callbacks may use this and other replies.
        """
        with self._turn:
            if self._ended or self._busy:  # the running turn will see what has arrived
                return
            self._busy = True
            try:
                end = work()
            except Exception as error:  # for the caller, not for the executor of the robot
                gone = isinstance(error, InvalidHandle) and NoAnswer(self._gone())
                end = self._over_with(partial(self.set_exception, gone or error))
            self._busy = False
            if self._given:
                end = None
            self._given |= end is not None
        if end is not None:
            end()
            self.settled.set_result(None)
            self._arrived.set()
        if self._ended:
            self.freed.set_result(None)

    # --- in turn ---------------------------------------------------------------------------

    def _next(self) -> End | None:
        """Resume the conversation while what it waits for is there."""
        while self._is_there():
            try:
                step = self._steps.send(None if self._sent is None else self._sent.result())
            except StopIteration as end:
                return self._over_with(partial(self.set_result, end.value))
            self._step, self._sent = step, None
            self._asked = self._seen = time.monotonic()
            if isinstance(step, Call):
                self._send(step)
            else:
                for each in step:
                    each.add_done_callback(self._go_on)
        return None

    def _give_up(self, end: End) -> End:
        """End, and with it the conversation unless its end is of interest."""
        return end if self._lasting and self._sent is not None else self._over_with(end)

    def _over_with(self, end: End) -> End:
        """End with the conversation."""
        self._ended = True
        self._steps.close()
        if isinstance(self._step, Call) and self._sent is not None and self._link is not None:
            with contextlib.suppress(InvalidHandle):
                client = self._link.client(self._step.service, self._step.kind)
                client.remove_pending_request(self._sent)
        return end

    def _is_there(self) -> bool:
        if isinstance(self._step, Call):
            return self._sent is not None and self._sent.done()
        return all(each.done() for each in self._step)

    def _watch(self, now: float) -> End | None:
        """Send what could not be sent yet, resume, and give up if there is no hope."""
        if isinstance(self._step, Call) and self._sent is None:
            self._send(self._step)
        if (end := self._next()) is not None:
            return end
        if reason := self._hopeless(now):
            return self._over_with(partial(self.set_exception, NoAnswer(reason)))
        if now - self._begun > self._timeout + (LATE if self._given else 0.0):
            late = f'{self._peer} did not answer {self._what} within {self._timeout:g} s'
            return self._give_up(partial(self.set_exception, NoAnswer(late)))
        return None

    def _send(self, call: Call) -> None:
        """Send the request if its service is available: DDS drops messages without a reader."""
        if self._connection.gone():
            return
        link = self._connection.link()
        client = link.client(call.service, call.kind)
        if link.silent(time.monotonic()) or not client.service_is_ready():
            return
        self._link = link
        if call.request is None:
            self._sent = Future()
            self._sent.set_result(None)
        else:
            self._sent = client.call_async(call.request)
            self._sent.add_done_callback(self._go_on)

    def _gone(self) -> str:
        return f'{self._peer}: {self._connection.gone()} during {self._what}'

    def _hopeless(self, now: float) -> str:
        """Return why there will be no answer; empty while there may be one."""
        if self._connection.gone():
            return self._gone()
        if not isinstance(self._step, Call):
            return ''
        if self._sent is None or self._link is None:
            if now - self._asked <= self._patience:
                return ''
            return (
                f'no memory node answers as {self._peer} within {self._patience:g} s; start one '
                'with "ros2 run mlmem_ros memory_node", and check ROS_DOMAIN_ID and the name'
            )
        if self._link.client(self._step.service, self._step.kind).service_is_ready():
            self._seen = now
        if now - self._seen > GONE or self._link.silent(now):
            return f'{self._peer} went away during {self._what}: how it ended is not known'
        return ''


class Action:
    """Access to an action of a node, named like its request."""

    def __init__(self, connection: Connection, name: str, kind: Any) -> None:
        self.name = name
        self._connection = connection
        self._impl, self._goal = kind.Impl, kind.Goal
        self._listeners: dict[bytes, Callable[[Any], None]] = {}

    @property
    def served(self) -> bool:
        """Whether the node serves it, as far as is known."""
        return self._connection.link().serves(f'{self.name}/_action/send_goal')

    def request(self, arguments: Mapping[str, Any]) -> Any:
        """Return the request that sends a new goal, of what this build of its type knows."""
        number, known = UUID(uuid=list(uuid4().bytes)), fields(self._goal)
        given = {name: value for name, value in arguments.items() if name in known}
        return self._impl.SendGoalService.Request(goal_id=number, goal=self._goal(**given))

    def send(self, request: Any) -> Call:
        """Return the call that sends a goal."""
        return Call(f'{self.name}/_action/send_goal', self._impl.SendGoalService, request)

    def result(self, number: UUID) -> Call:
        """Return the call that gets an answer when the goal has ended."""
        request = self._impl.GetResultService.Request(goal_id=number)
        return Call(f'{self.name}/_action/get_result', self._impl.GetResultService, request)

    def cancel(self, number: UUID) -> None:
        """Ask to cancel a goal; its result will say how it ended."""
        client = self._connection.link().client(f'{self.name}/_action/cancel_goal', CancelGoal)
        client.call_async(CancelGoal.Request(goal_info=GoalInfo(goal_id=number)))

    def listen(self, number: UUID, hear: Callable[[Any], None]) -> None:
        """Listen to the feedback of a goal, until `forget`."""
        self._listeners[bytes(number.uuid)] = hear
        topic = f'{self.name}/_action/feedback'
        self._connection.link().hear(topic, self._impl.FeedbackMessage, self._hear)

    def forget(self, number: UUID) -> None:
        """Stop listening to a goal."""
        self._listeners.pop(bytes(number.uuid), None)

    def _hear(self, message: Any) -> None:
        if hear := self._listeners.get(bytes(message.goal_id.uuid)):
            hear(message.feedback)


class Goal(Reply[T]):
    """A requested procedure: a goal of the node's action if there is one, else a service call.

    Use it like any reply. If the node serves actions, it gives feedback meanwhile::

        goal = self.memory.write(5)
        async for feedback in goal:
            self.get_logger().info(f'{feedback.phase} {feedback.share:.0%}')
        content = await goal
    """

    _lasting = True

    def __init__(
        self,
        connection: Connection,
        what: str,
        action: Action | None,
        request: Any,
        kind: type[Any],
        after: Sequence[Reply[Any]],
        there: Call,
        service: Steps[T],
        timeout: float,
    ) -> None:
        """Send the request: wait for others and, with `there`, for the node; then ask it."""
        self._action = action
        self._request = request
        self._taken = self._unwanted = False
        self._news: deque[Any] = deque()
        self._new: tuple[Future, Future] | None = None
        super().__init__(connection, what, self._converse(after, there, kind, service), timeout)
        self.settled.add_done_callback(self._forget)

    def cancel_goal(self) -> bool:
        """Make the node stop this procedure, and nothing else, and release the strain.

        The reply then raises `RequestFailed`, once the strain is zero.

        Returns:
            Whether that is possible. Without actions it is not; `MemoryClient.abort` stops
            whatever runs.
        """
        if self._action is None or self.settled.done():
            return False
        self._unwanted = True
        if self._taken:
            self._action.cancel(self._request.goal_id)
        return True

    def __aiter__(self) -> Goal[T]:
        if self._action is not None and not self.settled.done():
            self._action.listen(self._request.goal_id, self._hear)
        return self

    async def __anext__(self) -> Any:
        """Wait for the next feedback; what came before the first wait is lost."""
        while not self._news:
            self._new = new = Future(executor=self._connection.node.executor), Future()
            if self.settled.done():
                raise StopAsyncIteration
            if not self._news:  # none has arrived meanwhile
                await _until(*new, self._connection)
        return self._news.popleft()

    def _converse(
        self, after: Sequence[Reply[Any]], there: Call, kind: type[Any], service: Steps[T]
    ) -> Steps[T]:
        if len(after) >= MOST:
            raise RequestRefused({'error': f'busy: {MOST} requests are already waiting'})
        yield [each.freed for each in after]
        yield there
        if self._action is None or not self._action.served:
            self._action = None
            return (yield from service)
        number = self._request.goal_id
        taken = yield self._action.send(self._request)
        if not taken.accepted:
            raise RequestRefused({'error': 'the node already has a goal with this id'})
        self._taken = True
        if self._unwanted:
            self._action.cancel(number)
        response = yield self._action.result(number)
        goal = self._request.goal
        answer: T = calls.answer_of(self._action.name, kind, response.result, goal)
        return answer

    def _hear(self, feedback: Any) -> None:
        self._news.append(feedback)
        self._tell()

    def _forget(self, _: Future) -> None:
        if self._action is not None:
            self._action.forget(self._request.goal_id)
        self._tell()

    def _tell(self) -> None:
        new, self._new = self._new, None
        for each in new or ():
            each.set_result(None)


@coroutine
def _until(future: Future, told: Future, connection: Connection) -> Generator[Any, None, None]:
    """Suspend a coroutine until a future is done or cancelled.

    Args:
        future: What an executor resumes its coroutine for.
        told: Is done right after it, and has no executor; asyncio's coroutines are resumed for it.
        connection: Whose node the executor spins.
    """
    try:
        loop = asyncio.get_running_loop()
    except RuntimeError:  # an executor runs the coroutine
        told.add_done_callback(connection.wake)
        yield from Future.__await__(future)
        return
    turn = loop.create_future()

    def resume() -> None:
        if not turn.done():  # or cancelled with its task
            turn.set_result(None)

    def wake(_: Future) -> None:
        connection.wake()  # which asyncio may spin
        with contextlib.suppress(RuntimeError):  # its loop is closed
            loop.call_soon_threadsafe(resume)

    told.add_done_callback(wake)
    try:
        while not turn.done():  # an executor that asyncio spins resumes its coroutine earlier
            turn._asyncio_future_blocking = True
            yield turn
    finally:
        told.remove_done_callback(wake)


def seconds(name: str, value: Any) -> float:
    """Return a time above 0.

    Raises:
        ValueError: It is none.
    """
    if isinstance(value, bool) or not isinstance(value, Real) or not float(value) > 0.0:
        raise ValueError(f'{name} must be above 0 s; got {clipped(value)}')
    return float(value)
