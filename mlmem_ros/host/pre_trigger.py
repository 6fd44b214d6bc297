# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The pre-trigger buffer: what a session contains from before its start.

A replay begins with the state of an idle device. So messages are kept in segments, each beginning
with such a state, and the oldest is dropped once the others reach back far enough.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field

from .. import threads
from ..device import Refused

Message = tuple[str, bytes, int]
"""Topic, CDR, and log time in nanoseconds."""

SEGMENTS = 4
"""Number of segments that cover the requested time; one more is being filled."""

MOST_BYTES = 64 * 2**20
"""Most bytes kept, whatever is requested."""

_OVERHEAD = 200
"""Bytes that a message takes in memory besides its CDR."""


@dataclass
class _Segment:
    tick: int
    first: int  # number of its first message
    header: Message
    messages: list[Message] = field(default_factory=list)
    size: int = 0


class PreTriggerBuffer:
    """A ring of segments, as in rosbag2's snapshot mode.

    Time is the element's own, counted in ticks: pace and pauses do not matter. No segment can
    begin while a procedure runs, so a long procedure is kept from its beginning; if it does not
    fit into `MOST_BYTES`, the ring starts again after it.
    """

    def __init__(self, seconds: float, tick_seconds: float) -> None:
        """Create it empty."""
        self._tick_seconds = tick_seconds
        self._ticks = round(seconds / tick_seconds)
        self._lock = threads.Lock()  # held for only a few instructions
        self._segments: deque[_Segment] = deque()
        self._tick = 0
        self._count = 0  # messages put so far, kept or not
        self._size = 0
        self._held = math.inf  # number of the first message that must stay, however old it is

    def due(self, tick: int) -> bool:
        """Return whether a segment should begin after a tick, if the device is idle."""
        self._tick = tick
        newest = self._segments[-1].tick if self._segments else -self._ticks
        return tick - newest >= self._ticks / SEGMENTS

    def begin(self, tick: int, header: Message) -> None:
        """Begin a segment, and drop those older than requested."""
        with self._lock:
            self._tick = tick
            self._segments.append(_Segment(tick, self._count, header))
            self._grow(header)
            while len(self._segments) > 1 and self._spare(self._segments[1]):
                self._drop()

    def put(self, topic: str, cdr: bytes, log_time: int) -> None:
        """Keep a message: cheap, from any thread."""
        with self._lock:
            self._count += 1
            if self._segments:
                message = topic, cdr, log_time
                self._segments[-1].messages.append(message)
                self._grow(message)
                while self._size > MOST_BYTES:
                    self._drop()

    def content(self) -> tuple[list[Message], int]:
        """Return what is kept as one session, a header first, and the number of the next message,
        from which on nothing grows too old until `release`; nothing is kept until an idle tick
        has come.
        """
        with self._lock:
            self._held = self._count
            headers = [each.header for each in self._segments]
            return [*headers[:1], *self._from(0)], self._count

    def since(self, number: int) -> list[Message]:
        """Return what came after `content` told a number.

        Raises:
            Refused: There was too much to keep.
        """
        with self._lock:
            oldest = self._segments[0].first if self._segments else self._count
            if number < oldest:
                raise Refused(f'the disk was slow, and {MOST_BYTES / 1e6:.0f} MB were not enough')
            return self._from(number)

    def release(self) -> None:
        """Let messages grow too old again."""
        self._held = math.inf

    def clear(self) -> None:
        """Discard everything; start again with the next idle tick."""
        with self._lock:
            self._segments.clear()
            self._size = 0

    @property
    def kept(self) -> dict[str, float]:
        """How much is kept, for diagnostics."""
        with self._lock:
            ticks = self._tick - self._segments[0].tick if self._segments else 0
            return {
                'last_seconds': round(ticks * self._tick_seconds, 3),
                'last_bytes': self._size,
            }

    def _spare(self, second: _Segment) -> bool:
        """Return whether what is kept suffices without the segment before the second."""
        return self._tick - second.tick >= self._ticks and second.first <= self._held

    def _from(self, number: int) -> list[Message]:
        return [
            message
            for each in self._segments
            for message in each.messages[max(0, number - each.first) :]
        ]

    def _grow(self, message: Message) -> None:
        size = len(message[1]) + _OVERHEAD
        self._segments[-1].size += size
        self._size += size

    def _drop(self) -> None:
        self._size -= self._segments.popleft().size
