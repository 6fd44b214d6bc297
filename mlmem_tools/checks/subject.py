# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The subject of a check, with the quantities that several checks share."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache

from mlmem_ros.device.pulse_corrections import PulseCorrection
from mlmem_ros.device.settings import Settings
from mlmem_ros.physics import Design, Specimen, StateError, wall_energy

from .quasistatic import Landscape, depinning_strain, held_landscape

SAMPLES = 6
"""Least number of sampled levels of a large element."""

LARGEST_STRAIN = 0.12
"""Largest strain tried on a wall, either sign."""

TOLERANCE = 1e-4
"""Accuracy of the strain at which a wall is released."""

LAUNCH = -1
"""Pseudo-level from which a launched wall comes to level 0."""

MOST_WORK = 1e9
"""Most cell steps that the simulations for one finding may take: some seconds."""

TICK_WORK = 6e4
"""Overhead of a device's tick, in cell steps."""

LEAST_CELLS = 100
"""A step of a shorter chain takes as long as that of one with this many cells."""


@dataclass(frozen=True)
class Subject:
    """A design and the settings of its instrument; or one element of the design, and its pulses.

    Attributes:
        trims: Factors on the launch and the steps of a write, by level; none: 1.

    Sampled levels are both kinds of site at the start, in the middle and at the end.
    """

    design: Design
    settings: Settings
    element: Specimen | None = None
    trims: tuple[PulseCorrection, ...] = ()

    @cached_property
    def made(self) -> Specimen:
        """The element."""
        return self.element or Specimen(self.design)

    @cached_property
    def levels(self) -> list[int]:
        """Sampled levels."""
        return sample(self.design.levels)

    @cached_property
    def steps(self) -> list[int]:
        """Sampled levels from which a wall has to step on."""
        return sample(self.design.levels - 1)

    @property
    def open_levels(self) -> list[int]:
        """Levels from which a wall rolls on; `LAUNCH` alone if there is a single level."""
        return self.steps or [LAUNCH]

    @cached_property
    def wall_energy(self) -> float:
        """Continuum energy of a wall at alpha = 1."""
        return wall_energy(self.design)

    @property
    def wall_width(self) -> float:
        """Continuum width of a wall in cells: its step over its slope at the barrier top."""
        psi = self.design.potential
        barrier = float(psi.energy(self.design.D_barrier) - psi.energy(self.design.D_s1))
        return (self.design.D_s2 - self.design.D_s1) / math.sqrt(2.0 * barrier)

    @property
    def gradient_force(self) -> float:
        """Mean force of the gradient on a wall, positive to the right: -gamma E / 2.

        Half of a wall's energy is in the potential, and only that is graded.
        """
        return -0.5 * self.design.gamma * self.wall_energy

    @property
    def drift_speed(self) -> float:
        """Speed at which the gradient moves a wall against the damping: -gamma / (2 eta)."""
        eta = self.design.eta
        return -self.design.gamma / (2.0 * eta) if eta > 0.0 else math.inf

    def released_at(self, level: int) -> float:
        """Return the site from which a wall rolls on to the next level once the strain is zero.

        A step ends at the extremum of s ahead, a launch at the least s before level 0.
        """
        if level == LAUNCH:
            return self.design.J - (self.design.J - self.design.j_0) % self.design.J_s
        defect, half = self.design.defect(level), 0.5 * self.design.J_s
        return defect + half - (defect - self.design.j_0) % half

    @cached_property
    def ways(self) -> dict[int, Landscape]:
        """Landscapes without strain from release to the next defect, by the level.

        Raises:
            StateError: A wall cannot be held there.
        """
        found = {}
        for level in self.open_levels:
            goal = self.design.defect(level + 1) - 1.0
            start = min(max(self.released_at(level), 2.0), goal - 1.0)
            found[level] = held_landscape(self.made, start, goal)
        return found

    def freeing(self, level: int, sign: float, *, kink: bool = False) -> float:
        """Return the strain that frees a wall; NaN if none does, or the level pins no wall."""
        return _freeing(self.element or self.design, level, sign, kink)

    def forward(self, *, kink: bool) -> dict[int, float]:
        """Return the strains that move a wall or a kink on, by the sampled level that it leaves.

        They are NaN as from `freeing`.
        """
        design = self.design
        signs = {
            n: -1.0 if design.freed_by_compression(n) is not kink else 1.0 for n in self.steps
        }
        return {level: self.freeing(level, sign, kink=kink) for level, sign in signs.items()}


@lru_cache(maxsize=256)  # whatever the instrument is set to
def _freeing(made: Design | Specimen, level: int, sign: float, kink: bool) -> float:
    try:
        return depinning_strain(made, level, sign, LARGEST_STRAIN, kink=kink, tolerance=TOLERANCE)
    except StateError:
        return math.nan


def sample(count: int) -> list[int]:
    """Return some of 0 ... count - 1: two neighbours at the start, the middle and the end."""
    if count <= SAMPLES:
        return list(range(max(0, count)))
    middle = count // 2
    return [0, 1, middle, middle + 1, count - 2, count - 1]
