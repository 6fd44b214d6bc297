# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a device tells while it runs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from .echo import Echo
from .reading import BLANK, Reading


@dataclass(frozen=True)
class Heard:
    """A probe has been answered, or was not within the listening time."""

    echo: Echo
    reading: Reading


@dataclass(frozen=True)
class Outcome:
    """How a procedure ended.

    Attributes:
        procedure: Its name: write, read, erase, calibrate or abort.
        success: Whether it reached its aim.
        error: Why not; empty on success.
        reading: The last reading it made, or None.
        attempts: Tries it took.
        start_tick: The tick in which it began.
        end_tick: The tick in which it ended.
    """

    procedure: str
    success: bool
    error: str
    reading: Reading | None
    attempts: int
    start_tick: int
    end_tick: int

    def as_dict(self) -> dict[str, Any]:
        """Return the outcome as plain values: what the ROS services answer as JSON."""
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
                'end': self.reading.end,
            }
            if self.reading.reason:
                values['reason'] = self.reading.reason
        ticks = self.end_tick - self.start_tick
        return values | {'attempts': self.attempts, 'ticks': ticks}


def describe_level(level: int) -> str:
    """Return a level as a person says it."""
    if level >= 0:
        return f'level {level}'
    return 'blank' if level == BLANK else 'undecodable'


Event = Heard | Outcome
