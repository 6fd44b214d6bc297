# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Static equilibria of the metamaterial over a fixed substrate, by Newton's method."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from .design import Design
from .errors import StateError
from .potential import Array
from .specimen import Specimen
from .statics import metamaterial_force, stiffness
from .tridiagonal import solve
from .wall import walls

TOLERANCE = 1e-12
"""Largest residual force per cell, over the stiffness of the stiffest cell."""


def blank(specimen: Specimen) -> Array:
    """Return the displacements of a blank, unstrained element at rest, shape (N,).

    Raises:
        StateError: As `relax`.
    """
    design = specimen.design
    v = np.full(design.N, design.D_s1)
    if not specimen.offsets.any():
        return v
    return relax(specimen, v + specimen.offsets, np.zeros(design.N))


def wall_profile(design: Design, position: float, *, kink: bool = False) -> Array:
    """Return the configuration of an anti-kink: s2 on the left of `position`, s1 on the right.

    The profile is that of a wall in a symmetric double well of the same barrier, a tanh: a
    first guess for `relax`.

    Args:
        design: The element.
        position: Where the wall is, in sites.
        kink: Whether it is a kink, with s1 on the left.

    Returns:
        Delta_j, shape (N,).
    """
    mean, half = 0.5 * (design.D_s1 + design.D_s2), 0.5 * (design.D_s2 - design.D_s1)
    profile = mean - half * np.tanh((design.sites - position) / _width(design))
    return design.D_s1 + design.D_s2 - profile if kink else profile


def relax(specimen: Specimen, v: Array, V: Array, *, iterations: int = 200) -> Array:
    """Return the stable equilibrium displacements v nearest to a guess, with the substrate at V.

    Stuck cells stay as in the guess.

    Newton's method with its matrix shifted until it is positive definite and its step capped
    at a fifth of a lattice constant, so that it goes downhill and stays in its basin.

    Args:
        specimen: The element.
        v: Guess, shape (N,).
        V: Substrate displacements, shape (N,).
        iterations: Bound on the Newton steps.

    Raises:
        StateError: No equilibrium was reached, or only an unstable one.
    """
    v = np.array(v, dtype=np.float64)
    for _ in range(iterations):
        force = metamaterial_force(specimen, v, V)
        diagonal = stiffness(specimen, v, V)
        force[_held(specimen)] = 0.0
        if np.abs(force).max() < TOLERANCE * diagonal.max():
            if _solve(specimen, diagonal, force) is None:
                raise StateError('the guess leads to an unstable equilibrium; move it a little')
            return v
        step = _downhill_step(specimen, diagonal, force)
        v += step * min(1.0, 0.2 / float(np.abs(step).max()))
    raise StateError(
        f'no equilibrium within {iterations} Newton steps; the residual force is '
        f'{np.abs(force).max():.3g}, above {TOLERANCE:g}'
    )


def resting_wall(specimen: Specimen, level: int) -> Array:
    """Return the displacements of an unstrained element with its wall pinned at a level.

    Returns:
        v_j, shape (N,): with no strain it is also the configuration.

    Raises:
        StateError: There is no such level, or its defect does not pin the wall.
    """
    design = specimen.design
    if not 0 <= level < design.levels:
        raise StateError(f'level must be from 0 to {design.levels - 1}; got {level}')
    defect = design.defect(level)
    guess = wall_profile(design, defect + 0.3) + specimen.offsets
    v = relax(specimen, guess, np.zeros(design.N))
    found = walls(design, v)
    if len(found) != 1 or abs(found[0].position - defect) > _width(design):
        left = ', '.join(f'one at {wall.position:.4g}' for wall in found) or 'none'
        raise StateError(f'the defect at j = {defect} pins no wall; {left} remains')
    return v


def _width(design: Design) -> float:
    """Return the length of a wall's tanh in cells, from the mean on-site stiffness."""
    return 2.0 / math.sqrt(0.5 * (design.k_s1 + design.k_s2))


def _downhill_step(specimen: Specimen, diagonal: Array, force: Array) -> Array:
    """Solve (H + shift) step = force with the least shift of 0, 0.01, 0.04 ... that is definite.

    H is tridiagonal with off-diagonal -k_r; the pivots of the elimination show its signs.
    """
    shift = 0.0
    while True:
        step = _solve(specimen, diagonal + shift, force)
        if step is not None:
            return step
        shift = 4.0 * shift if shift else 0.01


def _held(specimen: Specimen) -> NDArray[np.int64]:
    """Return the indices of the stuck cells."""
    return np.array(specimen.stuck, dtype=np.int64) - 1


def _solve(specimen: Specimen, diagonal: Array, right: Array) -> Array | None:
    """Solve the tridiagonal system; None if it is not positive definite."""
    solution, diagonal, beside = right[None].copy(), diagonal.copy(), -specimen.k_r
    held = _held(specimen)
    diagonal[held], beside[held], beside[held - 1] = 1.0, 0.0, 0.0
    return solution[0] if solve(diagonal, beside, solution) else None
