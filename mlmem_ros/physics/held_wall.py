# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The energy landscape of a wall with no ansatz: hold the wall at X and relax the rest.

"At X" is what `wall.walls` measures: between the sites j and j + 1 about X the configuration is
linearly interpolated, and where it meets the barrier top is the wall. That is one linear
constraint on two cells; its multiplier is the force that holds the wall, -dU/dX apart from a
factor. Newton's method is run for many positions side by side, one row of an array each.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .design import Design
from .equilibrium import wall_profile
from .errors import StateError
from .potential import Array

STIFFENING = 1.0
"""Stiffness that is added along the constraint: it changes no solution, and makes the matrix
positive definite where the landscape is a maximum."""

LARGEST_STEP = 0.2
"""Cap of a Newton step, in lattice constants, so that it stays in its basin."""


@dataclass(frozen=True)
class HeldWalls:
    """Walls held at positions, everything else relaxed.

    Attributes:
        positions: X in sites, shape (m,).
        v: Displacements, shape (m, N).
        energy: Energy of the metamaterial (springs and potential), shape (m,).
        force: Multiplier of the constraint, shape (m,): zero where the wall rests by itself.
    """

    positions: Array
    v: Array
    energy: Array
    force: Array


def hold_walls(
    design: Design,
    positions: Array,
    V: Array,
    *,
    guess: Array | None = None,
    tolerance: float = 1e-11,
    iterations: int = 100,
) -> HeldWalls:
    """Return anti-kinks held at positions over a fixed substrate.

    Args:
        design: The element.
        positions: X in sites, shape (m,), within 1 <= X < N.
        V: Substrate displacements, shape (N,).
        guess: Displacements to begin with, shape (m, N); by default a tanh at each position.
        tolerance: Largest residual force per cell.
        iterations: Bound on the Newton steps.

    Raises:
        StateError: A position is outside the element, or the method does not converge.
    """
    positions = np.asarray(positions, dtype=np.float64)
    if not (positions.size and positions.min() >= 1.0 and positions.max() < design.N):
        raise StateError(f'positions must be from 1 to below N = {design.N}; got {positions}')
    if guess is None:
        guess = np.array([wall_profile(design, X) for X in positions]) + V
    v = guess.copy()
    constraint = _Constraint(design, positions, V)
    force = np.zeros(len(positions))
    for _ in range(iterations):
        residual = _forces(design, v, V)
        along, ahead = constraint.normal, constraint.excess(v)
        diagonal = design.alpha * design.potential.stiffness(v - V) + 2.0
        diagonal[:, 0] -= 1.0
        diagonal[:, -1] -= 1.0
        free = _solve(diagonal, constraint, np.stack((residual, along)))
        force = (np.sum(along * free[0], axis=1) + ahead) / np.sum(along * free[1], axis=1)
        step = free[0] - force[:, None] * free[1]
        if np.abs(residual - force[:, None] * along).max() < tolerance > np.abs(ahead).max():
            return HeldWalls(positions, v, _energy(design, v, V), force)
        largest = np.abs(step).max(axis=1, keepdims=True)
        v += step * np.minimum(1.0, LARGEST_STEP / np.maximum(largest, 1e-300))
    raise StateError(
        f'held walls must converge within {iterations} Newton steps; the residual force is '
        f'{np.abs(residual - force[:, None] * along).max():.3g}'
    )


class _Constraint:
    """The interpolated configuration about X is at the barrier top: normal . v = value."""

    def __init__(self, design: Design, positions: Array, V: Array) -> None:
        self.left = np.floor(positions).astype(np.intp) - 1
        fraction = positions - np.floor(positions)
        self.rows = np.arange(len(positions))
        self.weights = np.stack((1.0 - fraction, fraction))
        self.normal = np.zeros((len(positions), design.N))
        self.normal[self.rows, self.left] = self.weights[0]
        self.normal[self.rows, self.left + 1] = self.weights[1]
        self._value = design.D_barrier + self.normal @ V

    def excess(self, v: Array) -> Array:
        """Return by how much the constraint is missed, shape (m,)."""
        return np.asarray(np.sum(self.normal * v, axis=1) - self._value)


def _solve(diagonal: Array, constraint: _Constraint, right: Array) -> Array:
    """Solve (H + stiffening normal normal^T) x = right, all rows at once (Thomas).

    Args:
        diagonal: Of H, shape (m, N); its off-diagonal is -1.
        constraint: Touches two neighbours, so that the matrix stays tridiagonal.
        right: Right-hand sides, shape (2, m, N).
    """
    rows, left, weights = constraint.rows, constraint.left, constraint.weights
    pivots, x = diagonal.copy(), right.copy()
    beside = np.full((len(rows), diagonal.shape[1] - 1), -1.0)
    pivots[rows, left] += STIFFENING * weights[0] ** 2
    pivots[rows, left + 1] += STIFFENING * weights[1] ** 2
    beside[rows, left] += STIFFENING * weights[0] * weights[1]
    for j in range(1, pivots.shape[1]):
        factor = beside[:, j - 1] / pivots[:, j - 1]
        pivots[:, j] -= factor * beside[:, j - 1]
        x[:, :, j] -= factor * x[:, :, j - 1]
    x[:, :, -1] /= pivots[:, -1]
    for j in range(pivots.shape[1] - 2, -1, -1):
        x[:, :, j] = (x[:, :, j] - beside[:, j] * x[:, :, j + 1]) / pivots[:, j]
    return x


def _forces(design: Design, v: Array, V: Array) -> Array:
    """Return the static force on every cell of every row, shape (m, N)."""
    stretch = np.diff(v, axis=1)
    force = -design.alpha * design.potential.slope(v - V)
    force[:, :-1] += stretch
    force[:, 1:] -= stretch
    return np.asarray(force)


def _energy(design: Design, v: Array, V: Array) -> Array:
    """Return the energy of the metamaterial of every row, shape (m,)."""
    on_site = np.sum(design.alpha * design.potential.energy(v - V), axis=1)
    return np.asarray(0.5 * np.sum(np.diff(v, axis=1) ** 2, axis=1) + on_site)
