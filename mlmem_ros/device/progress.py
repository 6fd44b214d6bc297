# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The progress of a procedure, for display; nothing else depends on it."""

from __future__ import annotations

from typing import NamedTuple

QUIETING = 'quieting'
STRAINING = 'straining'
LAUNCHING = 'launching'
SETTLING = 'settling'
LISTENING = 'listening'
"""Phases of any procedure."""

WAITING = 'waiting'
"""Phase of a request whose procedure has not begun, because another one runs."""


class Feedback(NamedTuple):
    """Feedback from a running procedure.

    Attributes:
        phase: Its present phase, one of the above; empty before its first tick.
        share: Elapsed share of the expected duration, 0 to 1.
        strain: Strain that the encoder of the transmission reads.
        attempts: Attempts so far, including the present one.
        place: Place among those that wait, from 1; 0 once it runs.
    """

    phase: str
    share: float
    strain: float
    attempts: int
    place: int = 0


class Progress:
    """The progress of one procedure.

    Attributes:
        procedure: Its name; empty before the first one.
        phase: Its present phase, one of the above; empty before its first tick.
        attempts: Attempts so far, including the present one.
        start_tick: The tick in which it began.
    """

    def __init__(self, procedure: str = '', tick: int = 0) -> None:
        self.procedure = procedure
        self.phase = ''
        self.attempts = 1
        self.start_tick = self._end = tick

    def expect(self, end: float) -> None:
        """Expect the end at this tick or later.

        A procedure that another one calls ends within the expected time; a further attempt
        prolongs it.
        """
        self._end = max(self._end, round(end))

    def tried(self, procedure: str, attempts: int) -> None:
        """Set the attempts of the procedure itself; those of one that it calls do not count."""
        if procedure == self.procedure:
            self.attempts = attempts

    def share(self, tick: int) -> float:
        """Return the elapsed share of the expected time, 0 to 1; 1 if it is late."""
        passed = tick - self.start_tick
        return passed / max(self._end - self.start_tick, passed, 1)
