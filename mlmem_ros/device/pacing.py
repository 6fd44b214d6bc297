# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Clocks that pace a loop: when the next tick runs, never what it computes."""

from __future__ import annotations

from threading import Condition
from typing import Protocol

from .. import threads


class Pacer(Protocol):
    """A clock to wait on. It may stand still, jump, or run at any rate.

    Attributes:
        slack: Seconds of lag that are caught up; time lost beyond that is skipped. A clock that
            advances in steps needs more than one step.
        jumps: How often the clock has jumped further than that; no time is lost by a jump.
    """

    slack: float
    jumps: int

    def now(self) -> float:
        """Return the time in seconds."""

    def wait(self, changed: Condition, seconds: float) -> None:
        """Wait on a condition, whose lock is held, for at most this time.

        Returns early when the condition is notified, or the clock may have moved.
        """


class SteadyPacer:
    """The steady clock of the machine: lost ticks are not caught up."""

    slack = 0.0
    jumps = 0

    def now(self) -> float:
        """Return the time in seconds."""
        return threads.monotonic()

    def wait(self, changed: Condition, seconds: float) -> None:
        """Wait on a condition for at most this time."""
        changed.wait(seconds)
