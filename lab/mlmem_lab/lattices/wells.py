# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An on-site energy in pieces, one for all cells or one each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from mlmem_ros.physics.jit import formula
from mlmem_ros.physics.potential import Array

from .law import OnSite
from .pieces import Pieces, slope_of


class Constants(NamedTuple):
    """What the loops take: of every cell, shapes (n, m, 5), (n, m - 1) and (n,)."""

    coefficients: Array
    edges: Array
    tilt: Array


@formula(Constants)
def well(constants: Constants, j: int, y: float) -> tuple[float, float]:
    """Return the slope."""
    coefficients, edges, tilt = constants
    return slope_of(coefficients[j], edges[j], y) + tilt[j], 1.0


@dataclass(frozen=True, eq=False)
class Wells(OnSite):
    """Cells with an energy in pieces.

    Attributes:
        tilt: A force against positive D, one number or shape (n,).
    """

    each: Pieces | Sequence[Pieces]
    tilt: Array | float = 0.0

    def energy(self, x: ArrayLike) -> Array:
        """Return the energy of every cell."""
        return np.asarray(self._derivative(x, 0) + self.tilt * np.asarray(x))

    def slope(self, x: ArrayLike) -> Array:
        """Return its slope."""
        return np.asarray(self._derivative(x, 1) + self.tilt)

    def _derivative(self, x: ArrayLike, order: int) -> Array:
        if isinstance(self.each, Pieces):
            return self.each.derivative(x, order)
        columns = np.moveaxis(np.asarray(x, dtype=np.float64), -1, 0)
        found = [one.derivative(u, order) for one, u in zip(self.each, columns, strict=True)]
        return np.stack(found, axis=-1)

    def constants(self, n: int) -> Constants:
        """Return coefficients, edges and tilt of every cell."""
        each = [self.each] * n if isinstance(self.each, Pieces) else list(self.each)
        return Constants(
            np.array([one.coefficients for one in each]),
            np.array([one.edges for one in each]),
            np.broadcast_to(np.asarray(self.tilt, dtype=np.float64), n).copy(),
        )
