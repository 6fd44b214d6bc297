# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Couplings: springs, linear as a memory's or Toda's, and neighbours that repel by a power law."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from mlmem.physics.jit import register_formula
from mlmem.physics.potential import Array

from .lattice import Coupling


@dataclass(frozen=True)
class Linear(Coupling):
    """Springs of stiffness 1."""

    def energy(self, x: ArrayLike) -> Array:
        """Return e^2 / 2."""
        return np.asarray(0.5 * np.square(x))

    def slope(self, x: ArrayLike) -> Array:
        """Return e."""
        return np.array(x, dtype=np.float64)

    def constants(self) -> tuple[float, ...]:
        """Return nothing."""
        return ()


class PowerLawConstants(NamedTuple):
    """What the loops take: A, p, and the distances."""

    A: float
    power: float
    distance: float
    touch: float


@register_formula(PowerLawConstants)
def power_law_force(
    constants: PowerLawConstants, j: int, left: float, x: float, right: float
) -> float:
    """Return the pull of both neighbours, which is the difference of two pushes."""
    A, power, distance, touch = constants
    before = max(distance + (x - left), touch) ** power
    after = max(distance + (right - x), touch) ** power
    net: float = A * (before - after)
    return net


@dataclass(frozen=True)
class PowerLaw(Coupling):
    """Neighbours that repel, as magnets do: A r^p at a distance r, about their distance at rest.

    Attributes:
        A: Repulsion at a distance of 1.
        power: Exponent p, below 0 and not -1.
        distance: Between neighbours at rest.
        touch: Distance below which the repulsion grows no more, so that neighbours that are
            driven into each other stop no computation.
    """

    A: float
    power: float
    distance: float
    touch: float = 1e-3

    def energy(self, x: ArrayLike) -> Array:
        """Return the energy of a pair, 0 at rest, together with the push that holds them there."""
        p, r = self.power, self._clip_distance(x)
        at_rest = self.distance ** (p + 1.0)
        potential = -self.A * (r ** (p + 1.0) - at_rest) / (p + 1.0)
        beyond = np.maximum(self.touch - (self.distance + np.asarray(x)), 0.0)
        held = self.distance**p * np.asarray(x)
        return np.asarray(potential + self.A * (self.touch**p * beyond + held))

    def slope(self, x: ArrayLike) -> Array:
        """Return their attraction, over that at rest."""
        return np.asarray(
            self.A * (self.distance**self.power - self._clip_distance(x) ** self.power)
        )

    def _clip_distance(self, x: ArrayLike) -> Array:
        return np.maximum(self.distance + np.asarray(x, dtype=np.float64), self.touch)

    def constants(self) -> PowerLawConstants:
        """Return A, p, and the distances."""
        return PowerLawConstants(self.A, self.power, self.distance, self.touch)


class TodaConstants(NamedTuple):
    """What the loops take: k / b and b."""

    scale: float
    b: float


@register_formula(TodaConstants)
def toda_force(constants: TodaConstants, j: int, left: float, x: float, right: float) -> float:
    """Return the pull of both springs."""
    scale, b = constants
    return scale * (math.exp(-b * (x - left)) - math.exp(-b * (right - x)))


@dataclass(frozen=True)
class Toda(Coupling):
    """Toda's springs (J. Phys. Soc. Jpn. 22, 431, 1967): energy k (exp(-b e) + b e - 1) / b^2,
    linear ones as b goes to 0.

    Attributes:
        k: Stiffness at rest.
        b: How they harden in compression, not 0.
    """

    k: float
    b: float

    def energy(self, x: ArrayLike) -> Array:
        """Return the energy of a spring."""
        y = self.b * np.asarray(x)
        return np.asarray(self.k / self.b**2 * (np.expm1(-y) + y))

    def slope(self, x: ArrayLike) -> Array:
        """Return its tension."""
        return np.asarray(-self.k / self.b * np.expm1(-self.b * np.asarray(x)))

    def constants(self) -> TodaConstants:
        """Return k / b and b."""
        return TodaConstants(self.k / self.b, self.b)
