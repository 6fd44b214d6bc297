# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A request under way: an rclpy future that can be awaited, or waited for."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Generator
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from rclpy.callback_groups import CallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.task import Future

from .errors import NoAnswer

T = TypeVar('T')

POLL = 0.05
"""Seconds between two looks at clock and graph while a request is under way."""

GRACE = 1.0
"""Seconds for which a node may be out of sight before an answer is given up."""


@dataclass(frozen=True)
class Call:
    """One service call: the client it goes through, and the request.

    A request that is None is not sent: it stands for the wait until the service is there.
    """

    client: Any
    request: Any = None


Steps = Generator[Call | Future, Any, T]
"""A conversation: yields calls and futures, is sent their results, returns its own."""


@dataclass(frozen=True)
class Line:
    """How a conversation reaches its peer.

    Attributes:
        node: The robot's node.
        group: Callback group of all that the conversation needs of the executor.
        peer: Full name of the memory node, for messages.
        patience: Seconds that a service may take to appear.
    """

    node: Node
    group: CallbackGroup
    peer: str
    patience: float


class Reply(Future, Generic[T]):
    """What becomes of a request, which is under way from the moment the reply is made.

    In a coroutine, such as a callback that is `async def`, await it::

        async def on_button(self, _):
            content = await self.memory.write(5)

    The executor runs other callbacks meanwhile, those of the same callback group excepted.
    Anywhere else, wait for it::

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
        self._call: Call | None = None
        self._sent: Future | None = None
        self._begun = self._asked = self._seen = time.monotonic()
        self._turn = threading.RLock()  # the caller's thread and the executor's may meet here
        with self._turn:
            self._timer = line.node.create_timer(
                POLL, self._look, line.group, Clock(clock_type=ClockType.STEADY_TIME)
            )
            self._advance()

    def __await__(self) -> Generator[None, None, T]:
        """Suspend the coroutine until the answer is there."""
        return super().__await__()

    def wait(self) -> T:
        """Block this thread until the answer is there.

        A node that is in no executor is turned meanwhile, callbacks and all. The executor of
        one that is in an executor has to spin in another thread.

        Returns:
            The answer.

        Raises:
            RequestError: There is none, or a bad one.
            RuntimeError: Called from a callback of the very executor that has to bring the
                answer, which would never come: make the callback `async def` and await.
        """
        executor = self._line.node.executor
        if executor is None:
            self._turn_the_node()
        elif _is_calling(executor):
            self.cancel()
            raise RuntimeError(
                f'{self._what}: a callback must not wait() for what its own executor brings; '
                'make the callback "async def" and await the reply'
            )
        else:
            answered = threading.Event()
            self.add_done_callback(lambda _: answered.set())
            answered.wait(max(0.0, self._left()) + GRACE)
        if not self.done():
            why = 'was cancelled' if self.cancelled() else 'got no answer: does its node spin?'
            raise NoAnswer(f'{self._line.peer}: {self._what} {why}')
        answer: T = self.result()
        return answer

    def cancel(self) -> None:
        """End the interest in the answer."""
        super().cancel()
        self._release()

    def _left(self) -> float:
        """Return the seconds until the time-out."""
        return self._begun + self._timeout - time.monotonic()

    def _turn_the_node(self) -> None:
        node = self._line.node
        with SingleThreadedExecutor(context=node.context) as executor:
            executor.add_node(node)
            try:
                executor.spin_until_future_complete(self, max(0.0, self._left()) + GRACE)
            finally:
                node.executor = None

    def _advance(self, done: Future | None = None) -> None:
        """Go on with the conversation once what it waited for is done."""
        with self._turn:
            if self.done() or self.cancelled():
                return
            try:
                if done is None:
                    step = next(self._steps)
                elif (error := done.exception()) is not None:
                    step = self._steps.throw(error)
                else:
                    step = self._steps.send(done.result())
            except StopIteration as end:
                self._release()
                self.set_result(end.value)
            except Exception as error:  # whoever asked shall hear of it
                self._release()
                self.set_exception(error)
            else:
                self._begin(step)

    def _begin(self, step: Call | Future) -> None:
        self._sent = None
        self._asked = self._seen = time.monotonic()
        if isinstance(step, Call):
            self._call = step
            self._send()
        else:
            self._call = None
            step.add_done_callback(self._advance)

    def _send(self) -> None:
        """Send the request if its service is there: DDS drops what nobody listens to."""
        assert self._call is not None
        if not self._call.client.service_is_ready():
            return
        if self._call.request is None:
            self._sent = Future()
            self._sent.set_result(None)
        else:
            self._sent = self._call.client.call_async(self._call.request)
        self._sent.add_done_callback(self._advance)

    def _look(self) -> None:
        """Look at clock and graph."""
        with self._turn:
            if self.done() or self.cancelled():
                return
            if self._call is not None and self._sent is None:
                self._send()
            if (reason := self._hopeless(time.monotonic())) and not self.done():
                self._release()
                self.set_exception(NoAnswer(reason))

    def _hopeless(self, now: float) -> str:
        peer, patience = self._line.peer, min(self._line.patience, self._timeout)
        if self._call is not None:
            if self._sent is None and now - self._asked > patience:
                return (
                    f'no memory node answers as {peer} within {patience:g} s; start one with '
                    '"ros2 run mlmem_ros memory_node", and mind ROS_DOMAIN_ID and the name'
                )
            if self._call.client.service_is_ready():
                self._seen = now
            elif self._sent is not None and now - self._seen > GRACE:
                return f'{peer} went away during {self._what}'
        if self._left() < 0.0:
            return f'{peer} did not answer {self._what} within {self._timeout:g} s'
        return ''

    def _release(self) -> None:
        """Leave nothing behind: neither timer nor pending request."""
        with self._turn:
            self._line.node.destroy_timer(self._timer)
            self._steps.close()
            if self._call is not None and self._sent is not None:
                self._call.client.remove_pending_request(self._sent)


def _is_calling(executor: Executor) -> bool:
    """Return whether this thread runs a callback of an executor that has but this thread."""
    frame = sys._getframe()
    while frame is not None:
        if frame.f_locals.get('self') is executor:
            return True
        frame = frame.f_back
    return False
