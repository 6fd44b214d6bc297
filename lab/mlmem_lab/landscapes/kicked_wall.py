# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A kicked wall by energy alone: where it stops, and how a pinned one swings.

The wall is a particle in its own landscape U(X), the energy of a wall held at X. In a medium where
waves run at speed 1, a wall of momentum p has the energy sqrt(U^2 + p^2) and the speed p over
that, and damping takes eta p of its momentum. What a kick puts in, and where the wall then is,
come from a simulation up to the release; from there on nothing is simulated, and nothing fitted.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mlmem_ros.device.reading import BLANK
from mlmem_ros.physics import Specimen
from mlmem_ros.physics.equilibrium import blank, energies, resting_wall, stiffness
from mlmem_ros.physics.held_wall import hold_walls
from mlmem_ros.physics.potential import Array
from mlmem_ros.physics.waves import band, wavenumber

EVERY = 0.25
"""Positions at which the landscape is tabulated, in cells."""

FIRST = 4.0
"""Position from which it is: nearer to the free end there is no wall."""


@dataclass(frozen=True)
class KickedWall:
    """The landscape of an element.

    Attributes:
        made: The element.
        positions: X in sites, shape (m,).
        energy: U over that of the blank element, shape (m,).
    """

    made: Specimen
    positions: Array
    energy: Array

    @classmethod
    def of(cls, made: Specimen) -> KickedWall:
        """Tabulate the landscape of an element, without strain."""
        design, still = made.design, np.zeros(made.design.N)
        positions = np.arange(FIRST, design.N - FIRST, EVERY)
        parts = np.array_split(positions, math.ceil(len(positions) / 100))
        held = np.concatenate([hold_walls(made, part, still).energy for part in parts])
        coupling, on_site, _ = energies(made, blank(made), still)
        return cls(made, positions, held - float(coupling + on_site))

    def level(self, stored: float, start: float) -> int:
        """Return at which level a wall stops that has an energy where it is let go; `BLANK` if it
        turns back, the number of levels if it runs out at the right.
        """
        design, dt = self.made.design, 0.5
        slope = np.gradient(self.energy, EVERY)
        x = max(FIRST, start)
        rest = float(np.interp(x, self.positions, self.energy))
        p = math.sqrt(max(0.0, stored**2 - rest**2))
        for _ in range(round(12.0 / design.eta / dt)):
            at = (x - FIRST) / EVERY
            k = min(max(int(at), 0), len(slope) - 2)
            force = slope[k] + (at - k) * (slope[k + 1] - slope[k])
            U = self.energy[k] + (at - k) * (self.energy[k + 1] - self.energy[k])
            whole = math.hypot(U, p)
            p += dt * (-force * U / whole - design.eta * p)
            x += dt * p / math.hypot(U, p)
            if x < FIRST:
                return BLANK
            if x > self.positions[-1]:
                return design.levels
        return min(max(0, round(x / design.J) - 1), design.levels)


def modes(made: Specimen, level: int, count: int = 3) -> Array:
    """Return the lowest angular frequencies of an element with its wall at a level."""
    design = made.design
    v = resting_wall(made, level)
    off = -np.asarray(made.k_r)
    matrix = np.diag(stiffness(made, v, np.zeros(design.N))) + np.diag(off, 1) + np.diag(off, -1)
    root = 1.0 / np.sqrt(made.masses)
    values = np.linalg.eigvalsh(root[:, None] * matrix * root)
    return np.asarray(np.sqrt(np.maximum(values[:count], 0.0)))


def edges(made: Specimen) -> tuple[float, float]:
    """Return the lower edges of the bands of both phases."""
    return band(made.design.k_s1)[0], band(made.design.k_s2)[0]


def pull(made: Specimen, omega: float) -> float:
    """Return the momentum that a wave gives a wall which it passes without reflection, for a unit
    of the wave's energy: negative, to the left, from either end.

    A wave of energy E carries the momentum E kappa / omega. In the soft phase, right of the wall,
    kappa is greater: a wave from the right leaves the difference at the wall, one from the left
    takes it along. (One that is reflected pushes the wall ahead of it.)
    """
    soft, stiff = (
        float(wavenumber(omega, each).real) for each in (made.design.k_s1, made.design.k_s2)
    )
    return (stiff - soft) / omega
