# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""All inputs of a device, procedures (see `mlmem_ros.procedures`) and what has no outcome.

A command is stamped with the tick at which it takes effect.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, get_args

from ..levels import JOINT
from ..procedures import Procedures
from .faults import Faults


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
        joint: The joint that moves: `JOINT`.
    """

    times: tuple[float, ...]
    strains: tuple[float, ...]
    rates: tuple[float, ...] = ()
    joint: str = JOINT

    def __post_init__(self) -> None:
        for name in ('times', 'strains', 'rates'):  # lists if they come from a file
            object.__setattr__(self, name, tuple(getattr(self, name)))


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

KINDS: dict[str, type[Any]] = {kind.__name__: kind for kind in get_args(Command)}
"""The commands by name."""


def is_number(value: object, limit: float) -> bool:
    """Return whether a value is a number of at most this magnitude; NaN and bools are not."""
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    return number and abs(value) <= limit  # type: ignore[arg-type]
