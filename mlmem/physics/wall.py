# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Positions of the domain walls: ground truth that the device itself never uses."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from ..errors import DesignError
from .curve import Curve
from .design import Design, as_design
from .potential import Potential
from .values import Array

if TYPE_CHECKING:
    from .specimen import Material


@dataclass(frozen=True)
class Wall:
    """A domain wall.

    Attributes:
        position: Where the configuration crosses the barrier top, in sites (linear between two).
        anti_kink: True with active (s2) on the left, like the memory's wall; False for a kink.
    """

    position: float
    anti_kink: bool


def find_walls(material: Material, configuration: Array) -> list[Wall]:
    """Return the walls of a configuration Delta_j = v_j - V_j, shape (N,), left to right."""
    height = configuration - as_design(material).D_barrier
    active = height > 0.0
    left = np.flatnonzero(active[:-1] != active[1:])
    fraction = height[left] / (height[left] - height[left + 1])
    return [
        Wall(float(position), bool(anti_kink))
        for position, anti_kink in zip(left + 1 + fraction, active[left], strict=True)
    ]


def arrival_tolerance(design: Design) -> float:
    """Return how near to its level a wall must rest to have arrived, in cells: 1.5, or a quarter
    of the distance of two levels if that is less.
    """
    return min(1.5, design.J / 4.0)


def find_level(material: Material, configuration: Array, tolerance: float = 1.0) -> int:
    """Return the level whose defect holds the only wall; -1 if blank; -2 for anything else.

    A cell in a ground state other than the two phases gives -2.

    Args:
        configuration: Delta_j = v_j - V_j, shape (N,).
        tolerance: How near to the defect, in cells.
    """
    design = as_design(material)
    low, high = design.wells
    if not (configuration.min() > low and configuration.max() < high):
        return -2
    found = find_walls(design, configuration)
    if not found and configuration.max() < design.D_barrier:
        return -1
    if len(found) != 1 or not found[0].anti_kink:
        return -2
    level = round(found[0].position / design.J) - 1
    distance = abs(found[0].position - design.defect_site(level))
    return level if 0 <= level < design.levels and distance < tolerance else -2


@lru_cache(maxsize=64)
def wall_energy_between(potential: Potential | Curve, n: int) -> float:
    """Return the continuum energy of a wall between ground states n and n + 1 of a potential, with
    springs of stiffness 1: the integral of sqrt(2 psi) over D.

    Raises:
        DesignError: The potential has no such ground states.
    """
    D = np.linspace(potential.ground_state(n), potential.ground_state(n + 1), 4001)
    psi = potential.energy(D)
    root = np.sqrt(2.0 * np.maximum(psi - psi[0], 0.0))
    return float(np.sum(0.5 * (root[1:] + root[:-1]) * np.diff(D)))


def wall_energy(material: Material) -> float:
    """Return the continuum energy of a wall at alpha = 1.

    It is the wall's mass, too: where waves run at speed 1, both are the integral of v_x^2.
    """
    design = as_design(material)
    return wall_energy_between(design.potential, design.phase)


def barrier_height(design: Design) -> float:
    """Return the energy of a cell at the barrier top above that of the inactive phase."""
    energy = design.potential.energy
    return float(energy(design.D_barrier) - energy(design.D_s1))


def wall_width(design: Design) -> float:
    """Return the continuum width of a wall in cells: its step over its slope at the barrier top.

    With the paper's potential it is 1 / sqrt(d).
    """
    return abs(design.D_s2 - design.D_s1) / math.sqrt(2.0 * barrier_height(design))


def next_wall_costs(potential: Potential | Curve, n: int) -> tuple[float, float]:
    """Return the energies of the walls from ground state n to the one below, and from n + 1 to the
    one above, over that of the wall between n and n + 1; infinity where there is no such state.
    """
    costs = []
    for other in (n - 1, n + 1):
        try:
            costs.append(wall_energy_between(potential, other) / wall_energy_between(potential, n))
        except DesignError:
            costs.append(math.inf)
    return costs[0], costs[1]
