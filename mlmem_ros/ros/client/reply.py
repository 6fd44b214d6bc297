# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A pending request: an rclpy future that can be awaited, or waited for."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Callable, Generator, Sequence
from functools import partial
from typing import Any, Generic, TypeVar

from rclpy.clock import Clock, ClockType
from rclpy.exceptions import InvalidHandle
from rclpy.task import Future

from ...contract.errors import NoAnswer
from .awaiting import TAKE, suspended
from .connection import Call, Connection

T = TypeVar('T')

POLL = 0.05
"""Seconds between two checks of clock and graph while a request is pending."""

GRACE = 1.0
"""Seconds that a node may be missing from the graph before its answer is given up."""

Steps = Generator[Call | Sequence['Reply[Any]'], Any, T]
"""A conversation: it yields a call and is sent the response, or yields replies and resumes when
all have ended; it returns the result."""

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
    """

    def __init__(self, connection: Connection, what: str, steps: Steps[T], timeout: float) -> None:
        """Begin a conversation about `what`, with a time-out in seconds for all of it."""
        super().__init__(executor=connection.node.executor)
        if not timeout > 0.0:
            raise ValueError(f'timeout must be above 0 s; got {timeout!r}')
        self._connection = connection
        self._what = what
        self._steps = steps
        self._timeout = timeout
        self._step: Call | Sequence[Reply[Any]] = ()
        self._sent: Future | None = None
        self._begun = self._asked = self._seen = self._looked = time.monotonic()
        self._over = False  # set when settled
        self._settled = threading.Event()  # wakes the waiting thread
        self._busy = False
        self._turn = threading.RLock()  # a waiting thread and the executor's may meet here
        with self._turn:
            self._timer = connection.node.create_timer(
                POLL, self._look, connection.group, Clock(clock_type=ClockType.STEADY_TIME)
            )
        self._go_on()

    def __await__(self) -> Generator[Any, None, T]:
        """Suspend the coroutine, of rclpy or asyncio, until the answer comes."""
        return self._awaited().__await__()

    async def _awaited(self) -> T:
        try:
            await suspended(self, self._drive)
        except asyncio.CancelledError:  # asyncio's time-outs end what they wait for
            self.cancel()
            raise
        return self._answer()

    def wait(self) -> T:
        """Block this thread until the answer comes, and return it.

        The thread takes the answer itself. So this works whether or not anybody spins the node,
        even in a callback.

        Raises:
            RequestError: There is no answer, or it reports an error.
        """
        while not self._settled.wait(TAKE):
            self._drive()
        return self._answer()

    def _answer(self) -> T:
        if self.cancelled():
            raise NoAnswer(f'{self._connection.peer}: {self._what} was cancelled')
        answer: T = self.result()
        return answer

    def cancel(self) -> None:
        """Give up the answer."""
        self._settle(self._do(lambda: super(Reply, self).cancel))

    # --- going on, in whatever thread ------------------------------------------------------

    def _drive(self) -> None:
        """Do what an executor that spins the node would."""
        step = self._step
        if isinstance(step, Call):
            step.take()
        else:
            for part in step:
                part._drive()
        if time.monotonic() - self._looked > POLL:
            self._look()
        else:
            self._go_on()

    def _look(self) -> None:
        self._settle(self._do(self._watch))

    def _go_on(self, _: Future | None = None) -> None:
        """Resume the conversation if what it waits for is there."""
        self._settle(self._do(self._next))

    def _do(self, work: Callable[[], End | None]) -> End | None:
        """Do one thing at a time; return how the conversation ends, if it does."""
        with self._turn:
            if self._over or self._busy:  # the running turn will see what has arrived
                return None
            self._busy = True
            try:
                end = work()
            except InvalidHandle:
                gone = NoAnswer(
                    f'{self._connection.peer}: the node was destroyed during {self._what}'
                )
                end = partial(self.set_exception, gone)
            except Exception as error:  # for the caller, not for the executor of the robot
                end = partial(self.set_exception, error)
            finally:
                self._busy = False
            if end is not None:
                self._over = True
                self._release()
            return end

    def _settle(self, end: End | None) -> None:
        """Settle, without the lock: callbacks may use this and other replies."""
        if end is not None:
            end()
            self._settled.set()
            if (executor := self._connection.node.executor) is not None:
                executor.wake()

    # --- in turn ---------------------------------------------------------------------------

    def _next(self) -> End | None:
        """Resume the conversation while what it waits for is there."""
        while self._arrived():
            try:
                step = self._steps.send(None if self._sent is None else self._sent.result())
            except StopIteration as end:
                return partial(self.set_result, end.value)
            except Exception as error:  # for the caller
                return partial(self.set_exception, error)
            self._step, self._sent = step, None
            self._asked = self._seen = time.monotonic()
            if isinstance(step, Call):
                self._send(step)
            else:
                for part in step:
                    part.add_done_callback(self._go_on)
        return None

    def _arrived(self) -> bool:
        if isinstance(self._step, Call):
            return self._sent is not None and self._sent.done()
        return all(part.done() or part.cancelled() for part in self._step)

    def _watch(self) -> End | None:
        """Send what could not be sent yet, resume, and give up if there is no hope."""
        self._looked = time.monotonic()
        if isinstance(self._step, Call) and self._sent is None:
            self._send(self._step)
        if (end := self._next()) is not None:
            return end
        reason = self._hopeless(self._looked)
        return partial(self.set_exception, NoAnswer(reason)) if reason else None

    def _send(self, call: Call) -> None:
        """Send the request if its service is available: DDS drops messages without a reader."""
        if not self._connection.node.context.ok() or not call.client.service_is_ready():
            return
        if call.request is None:
            self._sent = Future()
            self._sent.set_result(None)
        else:
            self._sent = call.client.call_async(call.request)
            # or the callback would be a task, after which the events executor resumes nobody
            self._sent._set_executor = lambda executor: None
            self._sent.add_done_callback(self._go_on)

    def _hopeless(self, now: float) -> str:
        """Return why there will be no answer; empty while there may be one."""
        peer, patience = self._connection.peer, min(self._connection.patience, self._timeout)
        if not self._connection.node.context.ok():
            return f'{peer}: ROS was shut down during {self._what}'
        if isinstance(self._step, Call):
            if self._sent is None and now - self._asked > patience:
                return (
                    f'no memory node answers as {peer} within {patience:g} s; start one with '
                    '"ros2 run mlmem_ros memory_node", and check ROS_DOMAIN_ID and the name'
                )
            if self._step.client.service_is_ready():
                self._seen = now
            elif self._sent is not None and now - self._seen > GRACE:
                return f'{peer} went away during {self._what}: how it ended is not known'
        if now - self._begun > self._timeout:
            return f'{peer} did not answer {self._what} within {self._timeout:g} s'
        return ''

    def _release(self) -> None:
        self._connection.node.destroy_timer(self._timer)
        self._steps.close()
        if isinstance(self._step, Call) and self._sent is not None:
            self._step.client.remove_pending_request(self._sent)
