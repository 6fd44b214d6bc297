# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Events of a running device."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from .echo import Echo
from .reading import Reading, Unknown
from .shot import Shot


@dataclass(frozen=True)
class EchoReceived:
    """A probe and its reading, with or without an echo within the listening time."""

    echo: Echo
    reading: Reading


@dataclass(frozen=True)
class Check:
    """One test of a self-test.

    Attributes:
        name: What was tested.
        passed: Whether it passed.
        message: The result in words.
        values: The measured values, by name.
    """

    name: str
    passed: bool
    message: str
    values: dict[str, float] = field(default_factory=dict)


_ALWAYS = ('level', 'code', 'delay', 'level_margin', 'threshold_margin', 'confidence', 'end')
_IF_KNOWN = ('right_delay', 'walls', 'reason')


@dataclass(frozen=True)
class Outcome:
    """How a procedure ended.

    Attributes:
        procedure: Its name, one of `PROCEDURES`.
        success: Whether it succeeded.
        error: Why not; empty on success.
        reading: The last reading it made, or None.
        attempts: Attempts it took.
        start_tick: The tick in which it began.
        end_tick: The tick in which it ended.
        checks: The checks of a self-test.
        delays: Echo delay of every level in time units, by end, from a calibration.
        found: What else was measured, by name: numbers and words.
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
    found: dict[str, float | str] = field(default_factory=dict)

    def as_dict(self) -> dict[str, Any]:
        """Return the outcome as plain values, for the JSON answers of the ROS services."""
        values: dict[str, Any] = {'procedure': self.procedure}
        if self.error:
            values['error'] = self.error
        if self.reading is not None:
            found = {name: getattr(self.reading, name) for name in (*_ALWAYS, *_IF_KNOWN)}
            values |= {
                name: round(value, 4) if isinstance(value, float) else value
                for name, value in found.items()
                if name in _ALWAYS or value not in (None, '')
            }
        if self.checks:
            values['checks'] = {check.name: check.message for check in self.checks}
        if self.delays:
            values['delays'] = {
                end: [round(delay, 4) for delay in delays] for end, delays in self.delays.items()
            }
        ticks = self.end_tick - self.start_tick
        return values | self.found | {'attempts': self.attempts, 'ticks': ticks}


Event = EchoReceived | Shot | Outcome | Unknown
