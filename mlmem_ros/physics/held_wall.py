# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The energy landscape of a wall with no ansatz: hold the wall at X and relax the rest.

X is the position that `wall.walls` measures: where the configuration, linear between the sites j
and j + 1, meets the barrier top. Holding it is one linear constraint on two cells; its multiplier
is the force that holds the wall, -dU/dX apart from a factor. Newton's method runs for many
positions side by side, one row of an array each.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .equilibrium import wall_profile
from .errors import StateError
from .potential import Array
from .specimen import Specimen
from .statics import energies, metamaterial_force, stiffness
from .tridiagonal import solve

STIFFENING = 1.0
"""Stiffness added along the constraint: it changes no solution, and makes the matrix positive
definite at maxima of the landscape."""

TOLERANCE = 1e-11
"""Largest residual force per cell."""

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
    specimen: Specimen, positions: Array, V: Array, *, iterations: int = 100
) -> HeldWalls:
    """Return anti-kinks held at positions over a fixed substrate.

    Args:
        specimen: The element.
        positions: X in sites, shape (m,), within 1 <= X < N.
        V: Substrate displacements, shape (N,).
        iterations: Bound on the Newton steps.

    Raises:
        StateError: A position is outside the element, or the method does not converge.
    """
    design = specimen.design
    positions = np.asarray(positions, dtype=np.float64)
    if not (positions.size and positions.min() >= 1.0 and positions.max() < design.N):
        raise StateError(f'positions must be from 1 to below N = {design.N}; got {positions}')
    v = np.array([wall_profile(design, X) for X in positions]) + V  # a first guess
    # The constraint: normal . v = value.
    rows, left = np.arange(len(positions)), np.floor(positions).astype(np.intp) - 1
    ahead = positions - np.floor(positions)
    normal = np.zeros_like(v)
    normal[rows, left], normal[rows, left + 1] = 1.0 - ahead, ahead
    value = design.D_barrier + normal @ V
    beside = np.tile(-specimen.k_r, (len(rows), 1))
    beside[rows, left] += STIFFENING * (1.0 - ahead) * ahead
    for _ in range(iterations):
        residual = metamaterial_force(specimen, v, V)
        missed = np.sum(normal * v, axis=1) - value
        x = np.stack((residual, normal), axis=1)
        diagonal = stiffness(specimen, v, V) + STIFFENING * normal**2
        for row in rows:
            if not solve(diagonal[row], beside[row], x[row]):
                raise StateError(f'no wall can be held about {positions[row]:.4g}')
        unheld, per_force = x[:, 0], x[:, 1]
        force = (np.sum(normal * unheld, axis=1) + missed) / np.sum(normal * per_force, axis=1)
        left_over = np.abs(residual - force[:, None] * normal).max()
        if left_over < TOLERANCE > np.abs(missed).max():
            coupling, on_site, _ = energies(specimen, v, V)
            return HeldWalls(positions, v, coupling + on_site, force)
        step = unheld - force[:, None] * per_force
        largest = np.abs(step).max(axis=1, keepdims=True)
        v += step * np.minimum(1.0, LARGEST_STEP / np.maximum(largest, 1e-300))
    raise StateError(
        f'held walls must converge within {iterations} Newton steps; the residual force is '
        f'{left_over:.3g}'
    )
