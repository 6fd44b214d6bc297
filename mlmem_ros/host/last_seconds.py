# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The last seconds of an element, in memory: what a session contains from before its start.

A replay begins with the state of an idle device. So messages are kept in segments, each beginning
with such a state, and the oldest is dropped once the others reach back far enough.
"""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import replace

from .. import threads
from ..device import MemoryElement, Refused
from ..device.open_requests import Stamped
from .settings import SessionPlan
from .throttled_log import ThrottledLog
from .transcript import Message, Transcript

SEGMENTS = 4
"""Number of segments that cover the requested seconds; one more is being filled."""

MOST_BYTES = 64 * 2**20
"""Most bytes kept, whatever is requested."""

_OVERHEAD = 200
"""Bytes that a message takes in memory besides its CDR."""


class _Segment:
    def __init__(self, tick: int, header: Message) -> None:
        self.tick = tick
        self.messages = [header]
        self.size = len(header[1]) + _OVERHEAD


class LastSeconds(Transcript):
    """A ring of segments.

    Seconds are the element's own, counted in ticks: pace and pauses do not matter. No segment can
    begin while a procedure runs, so a long procedure is kept from its beginning; if it does not
    fit into `MOST_BYTES`, the ring starts again after it.
    """

    def __init__(
        self, plan: SessionPlan, log: ThrottledLog, now: Callable[[], int], element: MemoryElement
    ) -> None:
        """Start with the present state of an idle device; for the others see `Transcript`."""
        super().__init__(plan, log, now)
        self._tick_seconds = element.settings.tick_seconds
        self._ticks = round(plan.settings.last_seconds / self._tick_seconds)
        self._ticked = element.ticks
        self._lock = threads.Lock()  # held for only a few instructions
        self._segments: deque[_Segment] = deque()
        self._held = False
        self._begin(element)

    def tick(self, element: MemoryElement, commands: Sequence[Stamped]) -> None:
        """Take the commands of a tick, and the hash; begin a segment if due."""
        super().tick(element, commands)
        self._ticked = element.ticks
        newest = self._segments[-1].tick if self._segments else -self._ticks
        if element.ticks - newest >= self._ticks / SEGMENTS and not element.procedure:
            self._begin(element)

    def continued(self, plan: SessionPlan) -> SessionPlan:
        """Return the plan of a session that begins here, recorded as `plan` says."""
        return replace(self.plan, settings=plan.settings)

    @property
    def kept(self) -> dict[str, float]:
        """How much is kept, for diagnostics."""
        with self._lock:
            ticks = self._ticked - self._segments[0].tick if self._segments else 0
            size = sum(each.size for each in self._segments)
        return {'last_seconds': round(ticks * self._tick_seconds, 3), 'last_bytes': size}

    def clear(self) -> None:
        """Discard everything; start again with the next idle tick."""
        with self._lock:
            self._segments.clear()

    def hold(self) -> list[Message]:
        """Drop nothing until `release`; return what is kept as one session: a header first."""
        with self._lock:
            self._held = bool(self._segments)
            return self._session()

    def since(self, count: int) -> list[Message]:
        """Return what came after the first `count` messages, which `hold` returned.

        Raises:
            Refused: There were too many to keep.
        """
        with self._lock:
            if not self._held:
                raise Refused(f'the disk was slow, and {MOST_BYTES / 1e6:.0f} MB were not enough')
            return self._session()[count:]

    def release(self) -> None:
        """Allow the oldest to be dropped again."""
        with self._lock:
            self._held = False

    def _session(self) -> list[Message]:
        """Return all messages, with only the first of the headers."""
        messages = itertools.chain.from_iterable(each.messages[1:] for each in self._segments)
        return [*(each.messages[0] for each in [*self._segments][:1]), *messages]

    def _begin(self, element: MemoryElement) -> None:
        """Begin a segment, and drop those older than requested."""
        segments = self._segments
        begun = _Segment(element.ticks, self._header(element))
        with self._lock:
            segments.append(begun)
            while not self._held and len(segments) > 1 and self._reaches_back(segments[1]):
                segments.popleft()

    def _reaches_back(self, segment: _Segment) -> bool:
        return self._segments[-1].tick - segment.tick >= self._ticks

    def _keep(self, message: Message) -> None:
        with self._lock:
            segments = self._segments
            if not segments:
                return
            segments[-1].messages.append(message)
            segments[-1].size += len(message[1]) + _OVERHEAD
            while segments and sum(each.size for each in segments) > MOST_BYTES:
                segments.popleft()
                self._held = False
