# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pictures of a running element from its streams, and those of the last minute."""

from __future__ import annotations

import asyncio
import time
from collections import deque
from collections.abc import Callable
from typing import Any

import numpy as np

from mlmem_ros.contract import calls, topics

from .about import About
from .frames import counts, packed

PERIOD = 0.03
"""Least seconds between two pictures."""

TOGETHER = 0.004
"""Seconds within which the streams of one tick arrive."""

GAP = 0.2
"""Longest step of the picture's clock in seconds: without messages it stands still."""

HELD = 0.25
"""Longest time in seconds for which a picture that is like the last one is not sent."""

HISTORY = 1800
"""Pictures that are kept for a page that opens: a minute."""


class Pictures:
    """Makes pictures of the newest messages; any thread may call `take`, the loop the rest."""

    def __init__(self, loop: asyncio.AbstractEventLoop, due: Callable[[], None]) -> None:
        """Call `due` in the server's event loop when it is time for a picture."""
        self.clock = 0.0
        self._loop = loop
        self._due = due
        self._stamp = time.monotonic()
        self._newest: dict[topics.Topic, Any] = {}
        self._fresh = False
        self._history: deque[tuple[float, float, Any]] = deque(maxlen=HISTORY)
        self._shown: tuple[dict[str, Any], bytes] = ({}, b'')  # without its time
        self._held = 0.0  # until when nothing has changed since

    def take(self, topic: topics.Topic, message: Any) -> None:
        """Take a message of a stream."""
        self._newest[topic] = message
        if not self._fresh:
            self._fresh = True
            self._loop.call_soon_threadsafe(self._arrange)

    def forget(self) -> None:
        """Discard the history: it was another element's."""
        self._history.clear()

    def make(self, about: About, doing: dict[str, Any]) -> bytes | None:
        """Return a picture of the newest messages; None if it is like that of a moment ago."""
        field, joints = self._newest.get(topics.FIELD), self._newest.get(topics.JOINT_STATES)
        strain = 0.0 if joints is None else calls.displacement(joints) / about.length
        column = None  # a real element publishes none
        if field is not None and len(field.data) == about.design.N:
            column = counts(np.asarray(field.data)[:: about.stride], about.phases)
        shown = {'strain': strain, 'walls': self._walls(), **doing}
        bits = b'' if column is None else column.tobytes()
        since = self._history[-1] if self._history else (self._held - HELD, 0.0, None)
        if (shown, bits) == self._shown and self.clock - since[0] < HELD:
            self._held = self.clock
            return None
        self._shown = shown, bits
        head = {'k': 'picture', 't': self.clock, **shown}
        if self._history and self._held > since[0]:
            self._history.append((self._held, *since[1:]))
            head['held'] = self._held
        self._history.append((self.clock, strain, column))
        return packed(head, column)

    def past(self) -> bytes:
        """Return the pictures of the last minute in one frame."""
        columns = [(t, column) for t, _, column in self._history if column is not None]
        head = {
            'k': 'history',
            't': [t for t, _ in columns],
            'strain': [[t for t, *_ in self._history], [strain for _, strain, _ in self._history]],
            'walls': self._walls(),
        }
        return packed(head, np.stack([column for _, column in columns]) if columns else None)

    def _walls(self) -> list[float]:
        walls = self._newest.get(topics.WALL)
        return [] if walls is None else list(walls.data)

    def _arrange(self) -> None:
        """Schedule a picture, no sooner than a period after the last."""
        wait = self._stamp + PERIOD - time.monotonic()
        self._loop.call_later(max(wait, TOGETHER), self._make)

    def _make(self) -> None:
        self._fresh = False
        now = time.monotonic()
        self.clock += min(now - self._stamp, GAP)
        self._stamp = now
        self._due()
