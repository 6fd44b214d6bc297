# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""On-site energies: wells in cubic or quartic pieces, as of measured curves, and phi-4."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from mlmem.physics.jit import inline_function, register_formula
from mlmem.physics.potential import Array

from .lattice import OnSite

POLYNOMIAL_DEGREE = 4


@inline_function
def evaluate_slope(coefficients: Array, edges: Array, x: float) -> float:
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
        if self.coefficients.shape != (m, POLYNOMIAL_DEGREE + 1) or self.edges.shape != (m - 1,):
            raise ValueError(
                f'coefficients and edges must have shapes (m, {POLYNOMIAL_DEGREE + 1}) and (m - '
                f'1,); got '
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


class WellsConstants(NamedTuple):
    """What the loops take: of every cell, shapes (n, m, 5), (n, m - 1) and (n,)."""

    coefficients: Array
    edges: Array
    tilt: Array


@register_formula(WellsConstants)
def wells_slope(constants: WellsConstants, j: int, y: float) -> tuple[float, float]:
    """Return the slope."""
    coefficients, edges, tilt = constants
    return evaluate_slope(coefficients[j], edges[j], y) + tilt[j], 1.0


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
        return np.asarray(self._evaluate_derivative(x, 0) + self.tilt * np.asarray(x))

    def slope(self, x: ArrayLike) -> Array:
        """Return its slope."""
        return np.asarray(self._evaluate_derivative(x, 1) + self.tilt)

    def _evaluate_derivative(self, x: ArrayLike, order: int) -> Array:
        if isinstance(self.each, Pieces):
            return self.each.derivative(x, order)
        columns = np.moveaxis(np.asarray(x, dtype=np.float64), -1, 0)
        found = [one.derivative(u, order) for one, u in zip(self.each, columns, strict=True)]
        return np.stack(found, axis=-1)

    def constants(self, n: int) -> WellsConstants:
        """Return coefficients, edges and tilt of every cell."""
        each = [self.each] * n if isinstance(self.each, Pieces) else list(self.each)
        return WellsConstants(
            np.array([one.coefficients for one in each]),
            np.array([one.edges for one in each]),
            np.broadcast_to(np.asarray(self.tilt, dtype=np.float64), n).copy(),
        )


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
