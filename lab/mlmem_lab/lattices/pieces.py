# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Functions made of cubic or quartic pieces: measured curves, fitted or tabulated."""

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

    def bends_at_edges(self) -> Array:
        """Return by how much the slope jumps at the edges, shape (m - 1,)."""
        below, above = (
            [self._slope(piece, edge) for piece, edge in zip(pieces, self.edges, strict=True)]
            for pieces in (self.coefficients[:-1], self.coefficients[1:])
        )
        return np.asarray(np.array(above) - np.array(below), dtype=np.float64)

    @staticmethod
    def _slope(piece: Array, x: float) -> float:
        return float((piece[1:] * np.arange(1, DEGREE + 1) * x ** np.arange(DEGREE)).sum())


def tabulated(x: Array, slope: Array) -> Pieces:
    """Return an energy whose slope passes through points by a monotone cubic spline.

    The slope overshoots no point (Fritsch & Butland, SIAM J. Sci. Stat. Comput. 5, 300, 1984), and
    goes on straight beyond the table. The energy is 0 at x = 0 where the table begins below it, or
    else at its first point.

    Args:
        x: Rising, shape (m,), m >= 3.
        slope: Forces there, shape (m,).
    """
    if not (len(x) >= 3 and (np.diff(x) > 0.0).all() and np.isfinite(slope).all()):
        raise ValueError('a table must have at least three points, x rising, forces finite')
    h, secant = np.diff(x), np.diff(slope) / np.diff(x)
    bend = np.zeros(len(x))
    same = secant[:-1] * secant[1:] > 0.0
    first, second = 2.0 * h[1:] + h[:-1], h[1:] + 2.0 * h[:-1]
    safe = np.where(same, secant[:-1], 1.0), np.where(same, secant[1:], 1.0)
    bend[1:-1] = np.where(same, (first + second) / (first / safe[0] + second / safe[1]), 0.0)
    bend[[0, -1]] = secant[[0, -1]]
    rows = []
    for k in range(len(h)):
        c3 = (bend[k] + bend[k + 1] - 2.0 * secant[k]) / h[k] ** 2
        c2 = (3.0 * secant[k] - 2.0 * bend[k] - bend[k + 1]) / h[k]
        rows.append((slope[k], bend[k], c2, c3, x[k]))
    rows = [(slope[0], bend[0], 0.0, 0.0, x[0]), *rows, (slope[-1], bend[-1], 0.0, 0.0, x[-1])]
    coefficients = np.array([_energy(*row) for row in rows])
    for k in range(1, len(rows)):  # energies join
        powers = x[k - 1] ** np.arange(DEGREE + 1)
        coefficients[k, 0] += ((coefficients[k - 1] - coefficients[k]) * powers).sum()
    made = Pieces(coefficients, x)
    coefficients[:, 0] -= made.derivative(max(x[0], 0.0))
    return made


def _energy(f: float, f1: float, f2: float, f3: float, at: float) -> Array:
    """Return the coefficients of the energy whose slope is f + f1 (x - at) + ..., without c0."""
    slope = np.polynomial.Polynomial([f, f1, f2, f3])(np.polynomial.Polynomial([-at, 1.0]))
    coefficients = np.zeros(DEGREE + 1)
    found = slope.integ().coef
    coefficients[: len(found)] = found
    return coefficients
