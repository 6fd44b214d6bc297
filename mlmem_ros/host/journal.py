# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What people are told: never in floods, never at the length of what came in, nothing twice."""

from __future__ import annotations

import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Protocol

from .. import threads
from ..clipped import printable

AT_ONCE = 10
"""Lines in the log about one thing that may come at once."""

QUIET = 1.0
"""Seconds until one more may come."""

LONGEST = 500
"""Characters of a line; of a longer one the middle is left out."""


class Log(Protocol):
    """Where lines go: a ROS logger, or one of the standard library."""

    def info(self, message: str) -> Any:
        """Tell what happens."""

    def warning(self, message: str) -> Any:
        """Tell what was refused or looks odd."""

    def error(self, message: str) -> Any:
        """Tell what failed."""


class Journal:
    """Writes to a log from any thread, and is where exceptions end that are nobody's answer.

    Attributes:
        caught: How many of these there were.
    """

    def __init__(self, log: Log) -> None:
        self.caught = 0
        self._log = log
        self._lock = threads.Lock()
        self._allowed: dict[str, tuple[float, float]] = {}  # lines, and when that was counted
        self._withheld: dict[str, int] = {}

    def info(self, text: str, about: str = '') -> None:
        """Tell what happens; of lines about one thing, a flood comes as one a second."""
        if (since := self._due(about)) is not None:
            self._log.info(printable(text, LONGEST) + since)

    def warning(self, text: str, about: str = '') -> None:
        """Tell what looks odd; floods as those of `info`."""
        if (since := self._due(about)) is not None:
            self._log.warning(printable(text, LONGEST) + since)

    def error(self, text: str) -> None:
        """Tell what failed."""
        self._log.error(printable(text, LONGEST))

    def refused(self, what: str, why: object) -> None:
        """Tell of something refused; floods as those of `info`."""
        self.warning(f'{what} refused: {why}', what)

    def exception(self, where: str, error: BaseException) -> None:
        """Tell of a defect: an exception that nobody expected, with its traceback."""
        with self._lock:
            self.caught += 1
        if (since := self._due(where)) is not None:
            trace = ''.join(traceback.format_exception(error))
            self._log.error(f'{where} failed; this is a defect{since}:\n{trace}')

    @contextmanager
    def guarded(self, where: str) -> Iterator[None]:
        """Let no exception out of the body."""
        try:
            yield
        except Exception as error:
            self.exception(where, error)

    def _due(self, key: str) -> str | None:
        """Return what to add on how much was withheld, or None where it is too early to tell."""
        if not key:
            return ''
        with self._lock:
            now = threads.monotonic()
            allowed, counted = self._allowed.get(key, (AT_ONCE, now))
            allowed = min(AT_ONCE, allowed + (now - counted) / QUIET)
            if allowed < 1.0:
                self._allowed[key] = allowed, now
                self._withheld[key] = self._withheld.get(key, 0) + 1
                return None
            self._allowed[key] = allowed - 1.0, now
            withheld = self._withheld.pop(key, 0)
        return f' (and {withheld} times more since the last line)' if withheld else ''
