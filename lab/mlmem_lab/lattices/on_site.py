# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""On-site energies."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from mlmem.physics.jit import register_formula
from mlmem.physics.potential import Array

from .lattice import OnSite


class Phi4Constants(NamedTuple):
    """What the loops take."""

    height: float
    tilt: float


@register_formula(Phi4Constants)
def phi4_slope(constants: Phi4Constants, j: int, y: float) -> tuple[float, float]:
    """Return the slope."""
    height, tilt = constants
    return 4.0 * height * y * (y * y - 1.0) - tilt, 1.0


@dataclass(frozen=True)
class Phi4(OnSite):
    """A double well: energy h (1 - D^2)^2 - f D.

    Attributes:
        height: Of the barrier at D = 0, above 0.
        tilt: Force towards positive D.
    """

    height: float
    tilt: float = 0.0

    def energy(self, x: ArrayLike) -> Array:
        """Return the energy of a cell."""
        D = np.asarray(x, dtype=np.float64)
        return np.asarray(self.height * (1.0 - D * D) ** 2 - self.tilt * D)

    def slope(self, x: ArrayLike) -> Array:
        """Return its slope."""
        D = np.asarray(x, dtype=np.float64)
        return np.asarray(4.0 * self.height * D * (D * D - 1.0) - self.tilt)

    def constants(self, n: int) -> Phi4Constants:
        """Return height and tilt."""
        return Phi4Constants(self.height, self.tilt)
