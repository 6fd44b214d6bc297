# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How far a procedure is: what it tells of itself while it runs. Nothing depends on it."""

from __future__ import annotations

from typing import NamedTuple

QUIETING = 'quieting'
STRAINING = 'straining'
LAUNCHING = 'launching'
SETTLING = 'settling'
LISTENING = 'listening'
"""Phases of a procedure, of whatever kind."""


class Feedback(NamedTuple):
    """What is told of a procedure that runs.

    Attributes:
        phase: What it does at present, one of the above; empty before its first tick.
        share: Share of the time that it is expected to take in all, 0 to 1.
        strain: Strain of the substrate as the linkage's encoder has it.
        attempts: Tries so far, with the present one.
    """

    phase: str
    share: float
    strain: float
    attempts: int


class Progress:
    """The progress of one procedure.

    Attributes:
        procedure: Its name; empty where none runs.
        phase: What it does at present, one of the above; empty before its first tick.
        attempts: Tries so far, with the present one.
    """

    def __init__(self, procedure: str = '', tick: int = 0) -> None:
        """Begin at a tick."""
        self.procedure = procedure
        self.phase = ''
        self.attempts = 1
        self._begun = self._end = tick

    def expect(self, end: float) -> None:
        """Expect an end at this tick or later.

        So a procedure that another one makes use of prolongs nothing that was foreseen, and one
        that has to try again does.
        """
        self._end = max(self._end, round(end))

    def tried(self, procedure: str, attempts: int) -> None:
        """Count the tries of the procedure itself, not those of one that it makes use of."""
        if procedure == self.procedure:
            self.attempts = attempts

    def share(self, tick: int) -> float:
        """Return the share of the expected time that has passed, 0 to 1: 1 where it is late."""
        passed = tick - self._begun
        return passed / max(self._end - self._begun, passed, 1)
