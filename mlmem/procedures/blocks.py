# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a procedure returns; and the abort, which is hardly more."""

from __future__ import annotations

from dataclasses import dataclass, field

from ..commands import Check
from ..instrument.blocks import Procedure, ramp_strain
from ..memory import Memory
from ..readers.reading import Reading


@dataclass(frozen=True)
class Result:
    """The result of a procedure: last reading, attempts, checks, delays, other findings."""

    reading: Reading | None
    attempts: int = 1
    checks: tuple[Check, ...] = ()
    delays: dict[str, tuple[float, ...]] = field(default_factory=dict)
    found: dict[str, float | str] = field(default_factory=dict)


def abort(element: Memory) -> Procedure[Result]:
    """Release a held cell and bring the strain to zero, smoothly.

    As slowly as an erase: at the highest rate, one element in twenty was left with cells in a
    third ground state, which no strain clears (see `bring_back`).
    """
    times = element.settings.erase
    element.transducer.release_ends()
    if element.actuator.strain != 0.0 or element.actuator.is_moving:
        yield from ramp_strain(element, 0.0, times.release)
    return Result(None)
