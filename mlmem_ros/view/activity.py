# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a node is doing, as seen from outside: what it reports, or else a guess."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

LATE = 0.3
"""Seconds by which the feedback of a procedure may come after its outcome."""

PROCEDURES = ('write', 'read', 'erase', 'calibrate', 'self_test', 'abort')


class Activity:
    """The running procedure, from a page's request, an action or the diagnostics."""

    def __init__(self) -> None:
        self._name = ''
        self._level: int | None = None
        self._begun = 0.0
        self._ended = 0.0
        self._progress: dict[str, Any] = {}

    def told(self) -> dict[str, Any]:
        """Return its description for a picture."""
        if not self._name:
            return {}
        seconds = time.monotonic() - self._begun
        known = {'name': self._name, 'level': self._level, 'for': round(seconds, 2)}
        return {'doing': known | self._progress}

    def tells(self, name: str, feedback: Any) -> None:
        """Take the feedback of an action: the progress of its procedure."""
        if not self._name and time.monotonic() - self._ended > LATE:
            self._begin(name, None)
        if name != self._name:
            return
        self._progress = {
            'phase': feedback.phase,
            'share': round(feedback.share, 3),
            'attempts': feedback.attempts,
        }

    def asked(self, asked: Mapping[str, Any]) -> bool:
        """Note a page's request, unless something runs: then it is refused.

        Returns:
            Whether it was noted.
        """
        name = asked.get('do')
        taken = name in PROCEDURES and (not self._name or name == 'abort')
        if taken:
            self._begin(str(name), asked.get('level'))
        return taken

    def refused(self) -> None:
        """Remove the note."""
        self._name = ''

    def running(self, name: str) -> None:
        """Take the state from the diagnostics, which may be a second old."""
        now = time.monotonic()
        if name and not self._name and now - self._ended > 1.5:
            self._begin(name, None)
        elif not name and self._name and now - self._begun > 1.5:
            self._name = ''

    def ended(self, name: str) -> None:
        """Take the end of a procedure; an empty name means any."""
        if not name or name == self._name or self._name == 'abort':
            self._name = ''
            self._ended = time.monotonic()

    def _begin(self, name: str, level: Any) -> None:
        self._name, self._begun = name, time.monotonic()
        self._level = level if isinstance(level, int) else None
        self._progress = {}
