# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Events of a running device."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from .echo import Echo
from .reading import Reading


@dataclass(frozen=True)
class Heard:
    """A probe was answered, or not within the listening time."""

    echo: Echo
    reading: Reading


@dataclass(frozen=True)
class Check:
    """One test of a self-test.

    Attributes:
        name: What was tested.
        passed: Whether it is as required.
        message: What was found.
        values: What was measured, by name.
    """

    name: str
    passed: bool
    message: str
    values: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Outcome:
    """How a procedure ended.

    Attributes:
        procedure: Its name: write, read, erase, calibrate, self_test or abort.
        success: Whether it succeeded.
        error: Why not; empty on success.
        reading: The last reading it made, or None.
        attempts: Attempts it took.
        start_tick: The tick in which it began.
        end_tick: The tick in which it ended.
        checks: The checks of a self-test.
        delays: Echo delay of every level in time units, by end, from a calibration.
    """

    procedure: str
    success: bool
    error: str
    reading: Reading | None
    attempts: int
    start_tick: int
    end_tick: int
    checks: tuple[Check, ...] = ()
    delays: dict[str, tuple[float, ...]] = field(default_factory=dict)

    def as_dict(self) -> dict[str, Any]:
        """Return the outcome as plain values: the ROS services' answer as JSON."""
        values: dict[str, Any] = {'procedure': self.procedure}
        if self.error:
            values['error'] = self.error
        if self.reading is not None:
            values |= {
                'level': self.reading.level,
                'code': self.reading.code,
                'delay': None if self.reading.delay is None else round(self.reading.delay, 4),
                'level_margin': round(self.reading.level_margin, 4),
                'threshold_margin': round(self.reading.threshold_margin, 4),
                'confidence': round(self.reading.confidence, 4),
                'end': self.reading.end,
            }
            if self.reading.right_delay is not None:
                values['right_delay'] = round(self.reading.right_delay, 4)
            if self.reading.walls is not None:
                values['walls'] = self.reading.walls
            if self.reading.reason:
                values['reason'] = self.reading.reason
        if self.checks:
            values['checks'] = {check.name: check.message for check in self.checks}
        if self.delays:
            values['delays'] = {
                end: [round(delay, 4) for delay in delays] for end, delays in self.delays.items()
            }
        ticks = self.end_tick - self.start_tick
        return values | {'attempts': self.attempts, 'ticks': ticks}


Event = Heard | Outcome
