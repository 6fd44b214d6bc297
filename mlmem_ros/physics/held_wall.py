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
from .specimen import Specimen
from .statics import energies, metamaterial_force, stiffness
from .tridiagonal import solve

STIFFENING = 1.0
"""Stiffness added along the constraint: it changes no solution, and makes the matrix positive
definite at maxima of the landscape."""

LARGEST_STEP = 0.2
"""Cap of a Newton step, in lattice constants, so that it stays in its basin."""


@dataclass(frozen=True)
class HeldWalls:
    """Walls held at positions, everything else relaxed.

    Attributes:
        positions: X in sites, shape (m,).
        v: Displacements, shape (m, N).
        energy: Energy of the metamaterial (springs and potential), shape (m,).
        force: Multiplier of the constraint, shape (m,): zero where the wall rests unheld.
    """

    positions: Array
    v: Array
    energy: Array
    force: Array


def hold_walls(
    specimen: Specimen,
    positions: Array,
    V: Array,
    *,
    guess: Array | None = None,
    tolerance: float = 1e-11,
    iterations: int = 100,
) -> HeldWalls:
    """Return anti-kinks held at positions over a fixed substrate.

    Args:
        specimen: The element.
        positions: X in sites, shape (m,), within 1 <= X < N.
        V: Substrate displacements, shape (N,).
        guess: Displacements to begin with, shape (m, N); by default a tanh at each position.
        tolerance: Largest residual force per cell.
        iterations: Bound on the Newton steps.

    Raises:
        StateError: A position is outside the element, or the method does not converge.
    """
    design = specimen.design
    positions = np.asarray(positions, dtype=np.float64)
    if not (positions.size and positions.min() >= 1.0 and positions.max() < design.N):
        raise StateError(f'positions must be from 1 to below N = {design.N}; got {positions}')
    if guess is None:
        guess = np.array([wall_profile(design, X) for X in positions]) + V
    v = guess.copy()
    constraint = _Constraint(design, positions, V)
    force = np.zeros(len(positions))
    for _ in range(iterations):
        residual = metamaterial_force(specimen, v, V)
        along, ahead = constraint.normal, constraint.excess(v)
        by_itself, held = _solve(stiffness(specimen, v, V), constraint, residual)
        force = (np.sum(along * by_itself, axis=1) + ahead) / np.sum(along * held, axis=1)
        step = by_itself - force[:, None] * held
        if np.abs(residual - force[:, None] * along).max() < tolerance > np.abs(ahead).max():
            coupling, on_site, _ = energies(specimen, v, V)
            return HeldWalls(positions, v, coupling + on_site, force)
        largest = np.abs(step).max(axis=1, keepdims=True)
        v += step * np.minimum(1.0, LARGEST_STEP / np.maximum(largest, 1e-300))
    raise StateError(
        f'held walls must converge within {iterations} Newton steps; the residual force is '
        f'{np.abs(residual - force[:, None] * along).max():.3g}'
    )


class _Constraint:
    """The interpolated configuration about X is at the barrier top: normal . v = value."""

    def __init__(self, design: Design, positions: Array, V: Array) -> None:
        self.positions = positions
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


def _solve(diagonal: Array, constraint: _Constraint, residual: Array) -> tuple[Array, Array]:
    """Solve (H + stiffening normal normal^T) x = right for every row.

    Args:
        diagonal: Of H, shape (m, N); its off-diagonal is -1.
        constraint: Touches two neighbours, so that the matrix stays tridiagonal.
        residual: A right side, shape (m, N).

    Returns:
        x for the residual and for the normal, shape (m, N) each.
    """
    rows, left, weights = constraint.rows, constraint.left, constraint.weights
    x = np.stack((residual, constraint.normal), axis=1)
    beside = np.full((len(rows), diagonal.shape[1] - 1), -1.0)
    diagonal[rows, left] += STIFFENING * weights[0] ** 2
    diagonal[rows, left + 1] += STIFFENING * weights[1] ** 2
    beside[rows, left] += STIFFENING * weights[0] * weights[1]
    for row in rows:
        if not solve(diagonal[row], beside[row], x[row]):
            raise StateError(f'no wall can be held about {constraint.positions[row]:.4g}')
    return x[:, 0], x[:, 1]
