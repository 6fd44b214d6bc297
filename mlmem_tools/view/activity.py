# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a node is doing, as seen from outside: from requests, actions and diagnostics."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

from mlmem_ros.procedures import PROCEDURES

LATE = 0.3
"""Seconds by which feedback may come after the outcome of its procedure."""

STALE = 1.5
"""Age in seconds that a report in the diagnostics may have; they come once a second."""


class Activity:
    """The running procedure."""

    def __init__(self) -> None:
        self._doing: dict[str, Any] = {}
        self._begun = self._ended = -STALE

    def now(self) -> dict[str, Any]:
        """Return its description for a picture; empty if none runs."""
        if not self._doing:
            return {}
        return {'doing': {**self._doing, 'for': round(time.monotonic() - self._begun, 2)}}

    def asked(self, asked: Mapping[str, Any]) -> bool:
        """Note a page's request, unless a procedure runs, for then it will be refused; return
        whether it was noted.
        """
        name = asked.get('do')
        if name not in PROCEDURES or (self._doing and name != 'abort'):
            return False
        self._begin(name, asked.get('level', asked.get('word')))
        return True

    def refused(self) -> None:
        """Remove the note."""
        self._doing = {}

    def progress(self, name: str, feedback: Any) -> None:
        """Take the feedback of an action; what waits for its turn is not running."""
        if not feedback.attempts:
            return
        if not self._doing and time.monotonic() - self._ended > LATE:
            self._begin(name)
        if self._doing.get('name') == name:
            self._doing |= {
                'phase': feedback.phase,
                'share': round(feedback.share, 3),
                'attempts': feedback.attempts,
            }

    def reported(self, name: str) -> None:
        """Take the name of the running procedure, if any, from the diagnostics."""
        now = time.monotonic()
        if name and not self._doing and now - self._ended > STALE:
            self._begin(name)
        elif not name and now - self._begun > STALE:
            self._doing = {}

    def ended(self, name: str = '') -> None:
        """Take the end of a procedure; without a name, of any."""
        if not name or self._doing.get('name') in (name, 'abort'):
            self._doing = {}
            self._ended = time.monotonic()

    def _begin(self, name: str, level: Any = None) -> None:
        self._doing = {'name': name, 'level': level if isinstance(level, int | str) else None}
        self._begun = time.monotonic()
