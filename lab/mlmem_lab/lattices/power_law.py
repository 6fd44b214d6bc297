# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Magnets and the like: a repulsion A r^p at a distance r, p < 0, about their distance at rest."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from mlmem_ros.physics.jit import formula
from mlmem_ros.physics.potential import Array

from .law import Coupling


class Constants(NamedTuple):
    """What the loops take: A, p, and the distances."""

    A: float
    power: float
    distance: float
    touch: float


@formula(Constants)
def pull(constants: Constants, j: int, left: float, x: float, right: float) -> float:
    """Return the pull of both neighbours, which is the difference of two pushes."""
    A, power, distance, touch = constants
    before = max(distance + (x - left), touch) ** power
    after = max(distance + (right - x), touch) ** power
    net: float = A * (before - after)
    return net


@dataclass(frozen=True)
class PowerLaw(Coupling):
    """Repelling neighbours.

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
        p, r = self.power, self._distance(x)
        at_rest = self.distance ** (p + 1.0)
        potential = -self.A * (r ** (p + 1.0) - at_rest) / (p + 1.0)
        beyond = np.maximum(self.touch - (self.distance + np.asarray(x)), 0.0)
        held = self.distance**p * np.asarray(x)
        return np.asarray(potential + self.A * (self.touch**p * beyond + held))

    def slope(self, x: ArrayLike) -> Array:
        """Return their attraction, over that at rest."""
        return np.asarray(self.A * (self.distance**self.power - self._distance(x) ** self.power))

    def _distance(self, x: ArrayLike) -> Array:
        return np.maximum(self.distance + np.asarray(x, dtype=np.float64), self.touch)

    def constants(self) -> Constants:
        """Return A, p, and the distances."""
        return Constants(self.A, self.power, self.distance, self.touch)
