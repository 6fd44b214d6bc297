# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A wall held at X while the rest of an element relaxes.

The energy of a held wall is its landscape, with no ansatz. X is the position that `find_walls`
measures: where the configuration, linear between the sites j and j + 1, meets the barrier top.
Holding it is one linear constraint on two cells; its multiplier is the force that holds the wall,
-dU/dX apart from a factor. Newton's method runs for many positions side by side, one row of an
array each.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from ..errors import ErrorCode, StateError
from .design import Design, as_design
from .equilibrium import (
    compute_energies,
    metamaterial_force,
    solve_tridiagonal,
    stiffness_diagonal,
    wall_profile,
)
from .specimen import Material, as_specimen
from .values import Array


def make_uniform(material: Material) -> Design:
    """Return the uniform element of the same size: gamma = beta = 0."""
    return dataclasses.replace(as_design(material), gamma=0.0, beta=0.0)


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
    material: Material, positions: Array, V: Array, *, iterations: int = 100
) -> HeldWalls:
    """Return anti-kinks held at positions over a fixed substrate.

    Args:
        positions: X in sites, shape (m,), within 1 <= X < N.
        V: Substrate displacements, shape (N,).
        iterations: Bound on the Newton steps.

    Raises:
        StateError: A position is outside the element, or the method does not converge.
    """
    specimen = as_specimen(material)
    design = specimen.design
    positions = np.asarray(positions, dtype=np.float64)
    if not (positions.size and positions.min() >= 1.0 and positions.max() < design.N):
        expected = f'from 1 to below N = {design.N}'
        raise StateError.out_of_range('positions', positions, expected)
    v = np.array([wall_profile(design, X) for X in positions]) + V  # a first guess
    # The constraint: normal . v = value.
    rows, left = np.arange(len(positions)), np.floor(positions).astype(np.intp) - 1
    ahead = positions - np.floor(positions)
    normal = np.zeros_like(v)
    normal[rows, left], normal[rows, left + 1] = 1.0 - ahead, ahead
    value = design.D_barrier + normal @ V
    beside = np.tile(-specimen.k_r, (len(rows), 1))
    # A stiffness of 1 along the constraint changes no solution, and makes the matrix positive
    # definite at maxima of the landscape.
    beside[rows, left] += (1.0 - ahead) * ahead
    for _ in range(iterations):
        residual = metamaterial_force(specimen, v, V)
        missed = np.sum(normal * v, axis=1) - value
        x = np.stack((residual, normal), axis=1)
        diagonal = stiffness_diagonal(specimen, v, V) + normal**2
        for row in rows:
            if not solve_tridiagonal(diagonal[row], beside[row], x[row]):
                expected = 'farther from the ends, or less strained: no wall is held there'
                raise StateError(ErrorCode.CONFLICT, 'positions', positions[row], expected)
        unheld, per_force = x[:, 0], x[:, 1]
        force = (np.sum(normal * unheld, axis=1) + missed) / np.sum(normal * per_force, axis=1)
        left_over = np.abs(residual - force[:, None] * normal).max()
        if left_over < 1e-11 > np.abs(missed).max():  # of unit stiffnesses, per cell
            coupling, on_site, _ = compute_energies(specimen, v, V)
            return HeldWalls(positions, v, coupling + on_site, force)
        step = unheld - force[:, None] * per_force
        largest = np.abs(step).max(axis=1, keepdims=True)
        # cap the step, in lattice constants, so that it stays in its basin
        v += step * np.minimum(1.0, 0.2 / np.maximum(largest, 1e-300))
    expected = f'farther from the ends, or less strained: no wall is held in {iterations} steps'
    raise StateError(ErrorCode.CONFLICT, 'positions', positions, expected)
