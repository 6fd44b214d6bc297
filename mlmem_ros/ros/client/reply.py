# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A request under way: an rclpy future that can be awaited, or waited for."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Generator, Sequence
from functools import partial
from typing import Any, Generic, TypeVar

from rclpy.clock import Clock, ClockType
from rclpy.exceptions import InvalidHandle
from rclpy.task import Future

from ...contract.errors import NoAnswer
from .line import Call, Line

T = TypeVar('T')

POLL = 0.05
"""Seconds between two looks at clock and graph while a request is under way."""

TAKE = 0.002
"""Seconds between two looks for an answer by a thread that waits for it."""

GRACE = 1.0
"""Seconds for which a node may be out of sight before an answer is given up."""


Steps = Generator[Call | Sequence['Reply[Any]'], Any, T]
"""A conversation: yields a call and is sent its response, or yields replies and goes on when all
of them have ended; returns its own result."""


End = Callable[[], None]
"""Settles a reply: with a result, with an error, or as cancelled."""


class Reply(Future, Generic[T]):
    """What becomes of a request, which is under way from the moment the reply is made.

    In a coroutine, such as a callback that is `async def`, await it::

        async def on_button(self, _):
            content = await self.memory.write(5)

    The executor runs other callbacks meanwhile, those of the same callback group excepted:
    `MemoryClient.group` is one for callbacks that await. Anywhere else, wait for it::

        content = client.write(5).wait()

    or attach `add_done_callback`. However it is asked for, the result is the answer, or a
    `RequestError` is raised. `cancel` ends the interest in the answer; it does not stop the
    element, which `MemoryClient.abort` does.
    """

    def __init__(self, line: Line, what: str, steps: Steps[T], timeout: float) -> None:
        """Begin a conversation.

        Args:
            line: How to reach the peer.
            what: Its name, for messages.
            steps: The conversation.
            timeout: Longest time for all of it in seconds.
        """
        super().__init__(executor=line.node.executor)
        if not timeout > 0.0:
            raise ValueError(f'timeout must be above 0 s; got {timeout!r}')
        self._line = line
        self._what = what
        self._steps = steps
        self._timeout = timeout
        self._step: Call | Sequence[Reply[Any]] = ()
        self._sent: Future | None = None
        self._begun = self._asked = self._seen = self._looked = time.monotonic()
        self._over = False  # it is known what comes of it
        self._told = threading.Event()  # and who waits may look
        self._busy = False
        self._turn = threading.RLock()  # whoever waits and the executor's thread may meet here
        with self._turn:
            self._timer = line.node.create_timer(
                POLL, self._look, line.group, Clock(clock_type=ClockType.STEADY_TIME)
            )
        self._go_on()

    def __await__(self) -> Generator[None, None, T]:
        """Suspend the coroutine until the answer is there."""
        return super().__await__()

    def wait(self) -> T:
        """Block this thread until the answer is there.

        It is taken by the thread that waits, so that it comes whether or not anybody turns the
        node, in a callback too; but what else that thread has to do stands still meanwhile.

        Returns:
            The answer.

        Raises:
            RequestError: There is none, or a bad one.
        """
        while not self._told.wait(TAKE):
            self._drive()
        if self.cancelled():
            raise NoAnswer(f'{self._line.peer}: {self._what} was cancelled')
        answer: T = self.result()
        return answer

    def cancel(self) -> None:
        """End the interest in the answer."""
        self._tell(self._do(lambda: super(Reply, self).cancel))

    # --- going on, in whatever thread ------------------------------------------------------

    def _drive(self) -> None:
        """Do what an executor would that turned the node."""
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
        """Look at clock and graph."""
        self._tell(self._do(self._watch))

    def _go_on(self, _: Future | None = None) -> None:
        """Go on with the conversation if what it waits for is there."""
        self._tell(self._do(self._next))

    def _do(self, work: Callable[[], End | None]) -> End | None:
        """Do one thing at a time; return how the conversation ends, where it does."""
        with self._turn:
            if self._over or self._busy:  # busy: what was to come is there already, and is seen
                return None
            self._busy = True
            try:
                end = work()
            except InvalidHandle:
                gone = NoAnswer(f'{self._line.peer}: the node was destroyed during {self._what}')
                end = partial(self.set_exception, gone)
            finally:
                self._busy = False
            if end is not None:
                self._over = True
                self._release()
            return end

    def _tell(self, end: End | None) -> None:
        """Settle, out of turn: whom it is told may turn to us, and to other replies."""
        if end is not None:
            end()
            self._told.set()
            if (executor := self._line.node.executor) is not None:
                executor.wake()

    # --- in turn ---------------------------------------------------------------------------

    def _next(self) -> End | None:
        """Resume the conversation while what it waits for is there."""
        while self._arrived():
            try:
                step = self._steps.send(None if self._sent is None else self._sent.result())
            except StopIteration as end:
                return partial(self.set_result, end.value)
            except Exception as error:  # whoever asked shall hear of it
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
        """Send what could not be sent as yet, go on, and give up what is hopeless."""
        self._looked = time.monotonic()
        if isinstance(self._step, Call) and self._sent is None:
            self._send(self._step)
        if (end := self._next()) is not None:
            return end
        reason = self._hopeless(self._looked)
        return partial(self.set_exception, NoAnswer(reason)) if reason else None

    def _send(self, call: Call) -> None:
        """Send the request if its service is there: DDS drops what nobody listens to."""
        if not self._line.node.context.ok() or not call.client.service_is_ready():
            return
        if call.request is None:
            self._sent = Future()
            self._sent.set_result(None)
        else:
            self._sent = call.client.call_async(call.request)
            # or what follows were a task, after which the executor of events resumes nobody
            self._sent._set_executor = lambda executor: None
            self._sent.add_done_callback(self._go_on)

    def _hopeless(self, now: float) -> str:
        """Return why there will be no answer, or nothing."""
        peer, patience = self._line.peer, min(self._line.patience, self._timeout)
        if not self._line.node.context.ok():
            return f'{peer}: ROS was shut down during {self._what}'
        if isinstance(self._step, Call):
            if self._sent is None and now - self._asked > patience:
                return (
                    f'no memory node answers as {peer} within {patience:g} s; start one with '
                    '"ros2 run mlmem_ros memory_node", and mind ROS_DOMAIN_ID and the name'
                )
            if self._step.client.service_is_ready():
                self._seen = now
            elif self._sent is not None and now - self._seen > GRACE:
                return f'{peer} went away during {self._what}'
        if self._left() < 0.0:
            return f'{peer} did not answer {self._what} within {self._timeout:g} s'
        return ''

    def _left(self) -> float:
        """Return the seconds until the time-out."""
        return self._begun + self._timeout - time.monotonic()

    def _release(self) -> None:
        """Leave nothing behind: neither timer nor pending request."""
        self._line.node.destroy_timer(self._timer)
        self._steps.close()
        if isinstance(self._step, Call) and self._sent is not None:
            self._step.client.remove_pending_request(self._sent)
