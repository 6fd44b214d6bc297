# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Linear springs, a memory's coupling: energy e^2 / 2."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mlmem_ros.physics.potential import Array

from .law import Coupling


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
