# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Functions made of cubic or quartic pieces: measured curves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mlmem_ros.physics.jit import inlined
from mlmem_ros.physics.potential import Array

DEGREE = 4


@inlined
def slope_of(coefficients: Array, edges: Array, x: float) -> float:
    """Return the derivative at x of pieces, shapes (m, 5) and (m - 1,)."""
    k = 0
    for edge in edges:
        k += x > edge
    c1, c2, c3, c4 = coefficients[k, 1], coefficients[k, 2], coefficients[k, 3], coefficients[k, 4]
    slope: float = c1 + x * (2.0 * c2 + x * (3.0 * c3 + x * (4.0 * c4)))
    return slope


@dataclass(frozen=True, eq=False)
class Pieces:
    """An energy in pieces, each a polynomial of x; its slope should join at the edges.

    Attributes:
        coefficients: From power 0 up, shape (m, 5).
        edges: Between the pieces, rising, shape (m - 1,).
    """

    coefficients: Array
    edges: Array

    def __post_init__(self) -> None:
        m = len(self.coefficients)
        if self.coefficients.shape != (m, DEGREE + 1) or self.edges.shape != (m - 1,):
            raise ValueError(
                f'coefficients and edges must have shapes (m, {DEGREE + 1}) and (m - 1,); got '
                f'{self.coefficients.shape} and {self.edges.shape}'
            )
        if not (np.diff(self.edges) >= 0.0).all():
            raise ValueError('edges must rise')

    def derivative(self, x: ArrayLike, order: int = 0) -> Array:
        """Return the function or a derivative at x, any shape."""
        x = np.asarray(x, dtype=np.float64)
        taken: Array = self.coefficients[np.searchsorted(self.edges, x)]
        for _ in range(order):
            taken = np.asarray(taken[..., 1:] * np.arange(1.0, taken.shape[-1]))
        return np.asarray((taken * x[..., None] ** np.arange(taken.shape[-1])).sum(axis=-1))
