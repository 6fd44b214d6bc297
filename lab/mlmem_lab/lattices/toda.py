# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Toda's springs: energy k (exp(-b e) + b e - 1) / b^2, linear springs as b goes to 0."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from mlmem_ros.physics.jit import formula
from mlmem_ros.physics.potential import Array

from .law import Coupling


class Constants(NamedTuple):
    """What the loops take: k / b and b."""

    scale: float
    b: float


@formula(Constants)
def pull(constants: Constants, j: int, left: float, x: float, right: float) -> float:
    """Return the pull of both springs."""
    scale, b = constants
    return scale * (math.exp(-b * (x - left)) - math.exp(-b * (right - x)))


@dataclass(frozen=True)
class Toda(Coupling):
    """Toda's springs (J. Phys. Soc. Jpn. 22, 431, 1967).

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

    def constants(self) -> Constants:
        """Return k / b and b."""
        return Constants(self.k / self.b, self.b)
