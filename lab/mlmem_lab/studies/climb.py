# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A climb: every level is written and read back, and compared with the true wall."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from mlmem_ros.device import MemoryElement, Outcome, Write
from mlmem_ros.physics import level_of

from .trace import wall_position


@dataclass(frozen=True)
class WrittenLevel:
    """One write, verified by its echo, and the truth.

    Attributes:
        outcome: How the write ended, with its reading.
        level: Level at whose defect the wall really is; -1 blank; -2 none of them.
        wall: Its position in sites, NaN for none or several.
    """

    asked: int
    outcome: Outcome
    level: int
    wall: float

    @property
    def failure(self) -> str:
        """Why it failed.

        Returns:
            '' if the level was written and read back; 'wall' if the wall is elsewhere and the
            device knows that its write failed; 'silent' if it does not know; 'echo' if the wall is
            right and the reading is not.
        """
        if self.level != self.asked:
            return 'silent' if self.outcome.success else 'wall'
        return '' if self.outcome.success else 'echo'


@dataclass(frozen=True)
class Climb:
    """Levels written one after another, up to the first that failed."""

    writes: tuple[WrittenLevel, ...]
    levels: int

    @property
    def reached(self) -> int:
        """How many levels were written and read back."""
        return sum(not each.failure for each in self.writes)

    @property
    def passed(self) -> bool:
        """Whether all of them were."""
        return self.reached == self.levels

    @property
    def failure(self) -> str:
        """Why the last write failed, '' where all passed (see `WrittenLevel.failure`)."""
        return self.writes[-1].failure


class Heat:
    """A heat bath around the metamaterial, applied between ticks.

    Random kicks to the velocities return what the damping eta takes (fluctuation and dissipation):
    normally distributed with variance 2 eta T t / m^2 after every tick t. They are white noise far
    beyond the chain's highest frequency, and keep the mean energy of small waves at T per mode,
    whatever the tick.
    """

    def __init__(self, element: MemoryElement, temperature: float, seed: int) -> None:
        """Put a bath around a device.

        Args:
            element: The element; the damping and masses of its specimen are used.
            temperature: k_B T in k_r cells^2, at least 0.
        """
        specimen = element.chain.specimen
        self._velocity = element.chain.velocity
        self._kick = np.sqrt(2.0 * specimen.eta * temperature * element.tick) / specimen.masses
        self._random = np.random.Generator(np.random.PCG64(seed))

    def kick(self) -> None:
        """Give every cell the kicks of one tick."""
        self._velocity += self._kick * self._random.standard_normal(len(self._velocity))


def write_upward(
    element: MemoryElement,
    heat: Heat | None = None,
    level: Callable[[MemoryElement], int] | None = None,
) -> Climb:
    """Write every level from 0 up with one attempt each; stop at the first failure.

    Every write is the node's: it launches or drives the wall, probes it and decodes the echo. A
    level counts if the echo decodes to it and the wall is really there.

    Args:
        element: An element at rest; it is advanced.
        level: Returns the true level; by default the one within a cell of the wall.
    """
    assert element.settings.write.attempts == 1
    design, writes = element.design, []
    for asked in range(design.levels):
        outcome = element.perform(Write(asked), heat.kick if heat else None)
        found = element.chain.configuration
        true = level_of(design, found) if level is None else level(element)
        writes.append(WrittenLevel(asked, outcome, true, wall_position(design, found)))
        if writes[-1].failure:
            break
    return Climb(tuple(writes), design.levels)


def least_margins(outcomes: Iterable[Outcome]) -> dict[str, float | None]:
    """Return the least margins of all readings, by name; None without a finite one."""
    readings = [outcome.reading for outcome in outcomes if outcome.reading]
    return {
        name: min(filter(math.isfinite, (getattr(each, name) for each in readings)), default=None)
        for name in ('level_margin', 'threshold_margin')
    }
