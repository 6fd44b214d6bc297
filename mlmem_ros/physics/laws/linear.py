# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Linear springs, the paper's coupling: energy e^2 / 2, in units of k_r."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..jit import fma, inlined
from ..potential import Array
from .law import Coupling


@inlined
def neighbours(constants: tuple[float, ...], left: float, x: float, right: float) -> float:
    """Return the pull of both neighbours."""
    return fma(-2.0, x, left) + right


@dataclass(frozen=True)
class Linear(Coupling):
    """Springs of stiffness 1."""

    formula = staticmethod(neighbours)

    def energy(self, x: ArrayLike) -> Array:
        """Return e^2 / 2."""
        return np.asarray(0.5 * np.square(x))

    def slope(self, x: ArrayLike) -> Array:
        """Return e."""
        return np.array(x, dtype=np.float64)

    def stiffness(self, x: ArrayLike) -> Array:
        """Return 1."""
        return np.ones(np.shape(x))

    def constants(self) -> tuple[float, ...]:
        """Return nothing."""
        return ()
