# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The log for people: no floods, no overlong lines."""

from __future__ import annotations

import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Protocol

from .. import threads
from ..clipped import printable

AT_ONCE = 10
"""Lines about one subject that may be logged at once."""

QUIET = 1.0
"""Seconds after which one more is allowed."""

LONGEST = 500
"""Characters of a line; longer ones lose their middle."""


class Log(Protocol):
    """Where lines go: a ROS logger, or one from the standard library."""

    def info(self, message: str) -> Any:
        """Log an event."""

    def warning(self, message: str) -> Any:
        """Log a refusal or an oddity."""

    def error(self, message: str) -> Any:
        """Log a failure."""


class ThrottledLog:
    """Writes to a log from any thread, and catches exceptions that nobody else handles."""

    def __init__(self, log: Log) -> None:
        self.caught = 0
        self._log = log
        self._lock = threads.Lock()
        self._allowed: dict[str, tuple[float, float]] = {}  # lines remaining, and when computed
        self._withheld: dict[str, int] = {}

    def info(self, text: str, about: str = '') -> None:
        """Log an event; a flood of lines about one subject is thinned to one per second."""
        if (since := self._due(about)) is not None:
            self._log.info(printable(text, LONGEST) + since)

    def warning(self, text: str, about: str = '') -> None:
        """Log an oddity; floods are thinned as in `info`."""
        if (since := self._due(about)) is not None:
            self._log.warning(printable(text, LONGEST) + since)

    def error(self, text: str) -> None:
        """Log a failure."""
        self._log.error(printable(text, LONGEST))

    def refused(self, what: str, why: object) -> None:
        """Log a refusal; floods are thinned as in `info`."""
        self.warning(f'{what} refused: {why}', what)

    def exception(self, where: str, error: BaseException) -> None:
        """Log a fault in the software: an unexpected exception, with its traceback."""
        with self._lock:
            self.caught += 1
        if (since := self._due(where)) is not None:
            trace = ''.join(traceback.format_exception(error))
            self._log.error(f'{where} failed; this is a fault in the software{since}:\n{trace}')

    def cause(self, error: BaseException) -> None:
        """Log the traceback of what caused an expected error, if that was unexpected."""
        cause = error.__cause__
        if cause is None or isinstance(cause, (OSError, ImportError)):
            return
        kinds = f'{type(error).__name__} of {type(cause).__name__}'  # texts are without number
        if (since := self._due(kinds)) is not None:
            trace = ''.join(traceback.format_exception(cause))
            self._log.error(f'{printable(str(error), LONGEST)}{since}:\n{trace}')

    @contextmanager
    def guarded(self, where: str) -> Iterator[None]:
        """Catch and log every exception of the body."""
        try:
            yield
        except Exception as error:
            self.exception(where, error)

    def _due(self, key: str) -> str | None:
        """Return a note on how many lines were withheld, or None to withhold this one too."""
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
        return f' (and {withheld} more since the last line)' if withheld else ''
