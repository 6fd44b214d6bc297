# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Time that stands still, except for the steps of a test."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, TypeVar

from mlmem import element_file

from ..host.settings import DESCRIPTION
from .running import RunningNode

if TYPE_CHECKING:
    from ..ros.client.reply import Reply

T = TypeVar('T')


class FrozenClock:
    """Steps an element tick by tick, and publishes the time for nodes with `use_sim_time`.

    The element is paused and stepped, so it runs exactly the ticks of the elapsed time on any
    machine. Other nodes follow /clock.

    Attributes:
        now: ROS time in seconds.
        ticks: Ticks that the element has run under this clock.
    """

    def __init__(self, node: RunningNode) -> None:
        """Hold the time of an element, and of all nodes that follow /clock."""
        from rosgraph_msgs.msg import Clock

        self._node = node
        memory = node.memory
        text = memory.parameters(DESCRIPTION, timeout=60.0).wait()[DESCRIPTION]
        self._tick = element_file.parse(text, DESCRIPTION).settings.tick_seconds
        memory.pause().wait()
        self._kind = Clock
        self._publisher = memory.node.create_publisher(Clock, '/clock', 10)
        self.ticks = 0
        self._begun = self.now = 1.0  # rclpy treats 0 as not set
        self._publish_clock()

    def advance(self, seconds: float) -> None:
        """Let ROS time pass, and let the element answer requests; a remainder below a tick is kept
        for the next call.

        Raises:
            RequestError: The element has failed, or somebody has resumed its time.
        """
        end = self.now + seconds
        self._await_messages()
        while self.now < end:
            self.now = min(end, self.now + 0.01)
            due = round((self.now - self._begun) / self._tick) - self.ticks
            self.ticks += due
            if due:
                self._node.step(due)
            self._publish_clock()

    def advance_until(self, condition: Callable[[], object], within: float = 60.0) -> None:
        """Let time pass until a condition holds, which is checked every 20 ms, for at most so many
        seconds of ROS time.

        Raises:
            TimeoutError: It is not true by then.
        """
        end = self.now + within
        while not condition():
            if self.now >= end:
                raise TimeoutError(f'it did not happen within {within:g} s of ROS time')
            self.advance(0.02)
            self._await_messages()

    def finish(self, reply: Reply[T], within: float = 60.0) -> T:
        """Let time pass until a request of any client has been answered, for at most so many
        seconds of ROS time; return the answer.

        Raises:
            TimeoutError: It is not answered by then.
            RequestError: As in `Reply.wait`.
        """
        self.advance_until(reply.done, within)
        return reply.wait()

    def close(self) -> None:
        """Let time run again."""
        self._node.memory.node.destroy_publisher(self._publisher)
        if self._node.running:
            self._node.memory.pause(False).wait()

    def _await_messages(self) -> None:
        """Let messages to and from the element arrive: they precede the answer to a request."""
        self._node.memory.pause().wait()

    def _publish_clock(self) -> None:
        message = self._kind()
        message.clock.sec, message.clock.nanosec = divmod(round(self.now * 1e9), 10**9)
        self._publisher.publish(message)


@contextmanager
def frozen_clock(node: RunningNode) -> Iterator[FrozenClock]:
    """Freeze time until the end of the block; see `FrozenClock`.

    ::

        with frozen_clock(node) as clock:
            writing = node.memory.write(5)
            clock.advance(0.5)
            assert not writing.done()
            assert clock.finish(writing).level == 5
    """
    clock = FrozenClock(node)
    try:
        yield clock
    finally:
        clock.close()
