# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a node is doing, as far as it is known from outside: what it tells, or else a guess."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

LATE = 0.3
"""Seconds by which the feedback of a procedure may come after its outcome."""

PROCEDURES = ('write', 'read', 'erase', 'calibrate', 'self_test', 'abort')


class Activity:
    """The procedure that runs: as a page asked for it, an action tells or the diagnostics say."""

    def __init__(self) -> None:
        self._name = ''
        self._level: int | None = None
        self._begun = 0.0
        self._ended = 0.0
        self._progress: dict[str, Any] = {}

    def told(self) -> dict[str, Any]:
        """Return what a picture says of it."""
        if not self._name:
            return {}
        seconds = time.monotonic() - self._begun
        known = {'name': self._name, 'level': self._level, 'for': round(seconds, 2)}
        return {'doing': known | self._progress}

    def tells(self, name: str, feedback: Any) -> None:
        """Take the feedback of an action: how far the procedure of that name is."""
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
        """Take down what a page has asked for, unless something runs: that is refused.

        Returns:
            Whether it was taken down.
        """
        name = asked.get('do')
        taken = name in PROCEDURES and (not self._name or name == 'abort')
        if taken:
            self._begin(str(name), asked.get('level'))
        return taken

    def refused(self) -> None:
        """Take back what was taken down."""
        self._name = ''

    def running(self, name: str) -> None:
        """Take what the diagnostics say, which may be a second old."""
        now = time.monotonic()
        if name and not self._name and now - self._ended > 1.5:
            self._begin(name, None)
        elif not name and self._name and now - self._begun > 1.5:
            self._name = ''

    def ended(self, name: str) -> None:
        """Take an end; an empty name is that of any procedure."""
        if not name or name == self._name or self._name == 'abort':
            self._name = ''
            self._ended = time.monotonic()

    def _begin(self, name: str, level: Any) -> None:
        self._name, self._begun = name, time.monotonic()
        self._level = level if isinstance(level, int) else None
        self._progress = {}
