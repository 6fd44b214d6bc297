# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Events of a running device."""

from __future__ import annotations

from dataclasses import dataclass, field

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
        found: What else was measured, by name: as `contract.answers` declares it.
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

    @property
    def ticks(self) -> int:
        """How long it took."""
        return self.end_tick - self.start_tick


Event = EchoReceived | Shot | Outcome | Unknown
