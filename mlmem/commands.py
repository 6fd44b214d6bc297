# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a device takes and what it reports: commands, events, and feedback.

Commands are all its inputs: procedures (see `mlmem.procedure_table`) and what has no outcome. A
command is stamped with the tick at which it takes effect.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple, get_args

from .errors import OutcomeCode, Refused
from .instrument.echo import Echo
from .instrument.end import Shot
from .instrument.faults import Faults
from .procedure_table import JOINT_NAME, Procedures
from .readers.reading import Reading, Unknown

if TYPE_CHECKING:
    from .instrument.instrument import Phase


@dataclass(frozen=True)
class SetStrain:
    """Move the strain to a set-point by hand."""

    strain: float


@dataclass(frozen=True)
class FollowTrajectory:
    """Move the strain by hand along a timed profile, which begins with the next tick.

    Seconds are those of the device at speed 1: `scale.time` per time unit.

    Attributes:
        times: Of every point, in seconds since the beginning.
        strains: Of every point.
        rates: Of every point, in 1/s; empty for straight lines between them.
    """

    times: tuple[float, ...]
    strains: tuple[float, ...]
    rates: tuple[float, ...] = ()
    joint: str = JOINT_NAME

    def __post_init__(self) -> None:
        for name in ('times', 'strains', 'rates'):  # lists if they come from a file
            values = getattr(self, name)
            if not isinstance(values, Iterable):
                raise Refused.out_of_range(name, values, 'a list of numbers')
            object.__setattr__(self, name, tuple(values))


@dataclass(frozen=True)
class Disturb:
    """Shake the base: its acceleration in lattice constants per time unit squared."""

    acceleration: float


@dataclass(frozen=True)
class SetFaults:
    """Replace all faults by these."""

    faults: Faults


@dataclass(frozen=True)
class SetMethod:
    """Write by another method from now on: one of `write.method`."""

    method: str


Command = SetStrain | FollowTrajectory | Disturb | SetFaults | SetMethod | Procedures

COMMANDS_BY_NAME: dict[str, type[Any]] = {kind.__name__: kind for kind in get_args(Command)}
"""The commands by name."""


@dataclass(frozen=True)
class EchoReceived:
    """A probe and its reading, with or without an echo within the listening time."""

    echo: Echo
    reading: Reading


@dataclass(frozen=True)
class Check:
    """One test of a self-test."""

    name: str
    passed: bool
    message: str
    values: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Outcome:
    """How a procedure ended. Its generator returns it; the element adds which one and when.

    Attributes:
        reading: The last reading it made, or None.
        checks: Those of a self-test.
        delays: Echo delay of every level in time units, by end, from a calibration.
        found: What else was measured, by name: as `contract.answers` declares it.
        code: How it ended, in a word.
        error: Why it did not succeed; empty if it did.
        procedure: Its name, one of `PROCEDURES`.
        content_name: What the content in the reading is called, `level` or `word`.
    """

    reading: Reading | None
    attempts: int = 1
    checks: tuple[Check, ...] = ()
    delays: dict[str, tuple[float, ...]] = field(default_factory=dict)
    found: dict[str, float | str] = field(default_factory=dict)
    code: OutcomeCode = OutcomeCode.OK
    error: str = ''
    procedure: str = ''
    start_tick: int = 0
    end_tick: int = 0
    content_name: str = 'level'

    @property
    def success(self) -> bool:
        """Whether it did what it was to do."""
        return self.code is OutcomeCode.OK

    @property
    def level(self) -> int | None:
        """The content of one wall as last read; None without a reading, or of a register."""
        return self._find_content('level')

    @property
    def word(self) -> int | None:
        """The content of a register as last read; None without a reading, or of one wall."""
        return self._find_content('word')

    def _find_content(self, name: str) -> int | None:
        if self.reading is None or self.content_name != name:
            return None
        return self.reading.content

    @property
    def ticks(self) -> int:
        """How long it took."""
        return self.end_tick - self.start_tick


Event = EchoReceived | Shot | Outcome | Unknown


class Feedback(NamedTuple):
    """Feedback from a running procedure.

    Attributes:
        phase: Its present phase.
        share: Elapsed share of the expected duration, 0 to 1.
        strain: Strain that the encoder of the transmission reads.
        attempts: Attempts so far, including the present one.
        place: Place among those that wait, from 1; 0 once it runs.
    """

    phase: Phase
    share: float
    strain: float
    attempts: int
    place: int = 0
