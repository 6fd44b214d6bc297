# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Springs with an energy in pieces: a measured force curve."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mlmem_ros.physics.jit import inlined
from mlmem_ros.physics.potential import Array

from .law import Coupling
from .pieces import Pieces, slope_of


@inlined
def pull(constants: tuple[Array, Array], left: float, x: float, right: float) -> float:
    """Return the pull of both springs."""
    coefficients, edges = constants
    after = slope_of(coefficients, edges, right - x)
    return after - slope_of(coefficients, edges, x - left)


@dataclass(frozen=True, eq=False)
class Springs(Coupling):
    """Equal springs.

    Attributes:
        energies: Of a spring by its extension, with no slope at 0.
    """

    energies: Pieces
    formula = staticmethod(pull)

    def energy(self, x: ArrayLike) -> Array:
        """Return the energy of a spring."""
        return self.energies.derivative(x)

    def slope(self, x: ArrayLike) -> Array:
        """Return its tension."""
        return self.energies.derivative(x, 1)

    def stiffness(self, x: ArrayLike) -> Array:
        """Return its stiffness."""
        return self.energies.derivative(x, 2)

    def constants(self) -> tuple[Array, ...]:
        """Return coefficients and edges."""
        return np.array(self.energies.coefficients), np.array(self.energies.edges)
