# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Statics: energies and forces at rest, defined once, and equilibria by Newton's method.

Displacements v of the metamaterial and V of the substrate have shape (..., N): one state, or any
number of them at once. Energies are in k_r (lattice constant)^2. An equilibrium is that of the
metamaterial over a fixed substrate; its linear systems are tridiagonal.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..errors import ErrorCode, StateError
from .design import Design, as_design
from .jit import compile_kernel
from .specimen import Material, Specimen, as_specimen
from .values import Array
from .wall import find_walls


def compute_energies(material: Material, v: Array, V: Array) -> tuple[Array, Array, Array]:
    """Return the energies of coupling, on-site and substrate springs, shape (...) each."""
    specimen = as_specimen(material)
    D = v - (V + specimen.offsets)
    on_site = specimen.alpha * specimen.potential.energy(D)
    on_site = on_site - specimen.depth_force * (D - specimen.design.D_s1)
    return (
        np.asarray(0.5 * np.sum(specimen.k_r * np.diff(v) ** 2, axis=-1)),
        np.asarray(np.sum(on_site, axis=-1)),
        np.asarray(0.5 * np.sum(specimen.s * np.diff(V) ** 2, axis=-1)),
    )


def metamaterial_force(material: Material, v: Array, V: Array) -> Array:
    """Return the force on every cell, -dU/dv_j of Eq. (1a), shape (..., N)."""
    specimen = as_specimen(material)
    return _add_spring_pull(-_compute_on_site_pull(specimen, v, V), specimen.k_r * np.diff(v))


def substrate_force(material: Material, v: Array, V: Array) -> Array:
    """Return the force on every substrate site, -dU/dV_j of Eq. (1b), shape (..., N)."""
    specimen = as_specimen(material)
    return _add_spring_pull(_compute_on_site_pull(specimen, v, V), specimen.s * np.diff(V))


def stiffness_diagonal(material: Material, v: Array, V: Array) -> Array:
    """Return d2U/dv_j2, shape (..., N): the diagonal of a matrix with -k_r beside it."""
    specimen = as_specimen(material)
    on_site = specimen.alpha * specimen.potential.stiffness(v - (V + specimen.offsets))
    diagonal = on_site + specimen.coupling_stiffness
    diagonal[..., [0, -1]] -= specimen.k_r[[0, -1]]
    return np.asarray(diagonal)


def _compute_on_site_pull(specimen: Specimen, v: Array, V: Array) -> Array:
    """Return the pull of the on-site springs on the substrate, shape (..., N)."""
    slope = specimen.potential.slope(v - (V + specimen.offsets))
    return np.asarray(specimen.alpha * slope - specimen.depth_force)


def _add_spring_pull(force: Array, tension: Array) -> Array:
    """Add the pull of springs in series, tensions of shape (..., N - 1)."""
    force[..., :-1] += tension
    force[..., 1:] -= tension
    return force


@compile_kernel
def solve_tridiagonal(diagonal: Array, beside: Array, right: Array) -> bool:
    """Solve a system for several right sides if its matrix is positive definite.

    Args:
        diagonal: Diagonal of the matrix, shape (n,); the pivots of the elimination afterwards.
        beside: The off-diagonal, shape (n - 1,).
        right: Right sides, shape (k, n); the solutions afterwards.

    Returns:
        Whether the matrix is positive definite; if not, there are no solutions.
    """
    n = len(diagonal)
    for j in range(n):
        if j > 0:
            factor = beside[j - 1] / diagonal[j - 1]
            diagonal[j] -= factor * beside[j - 1]
            for i in range(len(right)):
                right[i, j] -= factor * right[i, j - 1]
        if diagonal[j] <= 0.0:  # NaN passes through, for the caller to see
            return False
    for i in range(len(right)):
        right[i, n - 1] /= diagonal[n - 1]
        for j in range(n - 2, -1, -1):
            right[i, j] = (right[i, j] - beside[j] * right[i, j + 1]) / diagonal[j]
    return True


def make_blank(material: Material) -> Array:
    """Return the displacements of a blank, unstrained element at rest, shape (N,).

    Raises:
        StateError: As `relax_to_equilibrium`.
    """
    specimen = as_specimen(material)
    design = specimen.design
    v = np.full(design.N, design.D_s1)
    if not (specimen.offsets.any() or specimen.depths.any()):
        return v
    return relax_to_equilibrium(specimen, v + specimen.offsets, np.zeros(design.N))


def wall_profile(material: Material, position: float, *, kink: bool = False) -> Array:
    """Return the configuration of an anti-kink: s2 on the left of `position`, s1 on the right.

    The profile is that of a wall in a symmetric double well of the same barrier, a tanh: a
    first guess for `relax_to_equilibrium`.

    Args:
        position: Where the wall is, in sites.
        kink: Whether it is a kink, with s1 on the left.

    Returns:
        Delta_j, shape (N,).
    """
    design = as_design(material)
    mean, half = 0.5 * (design.D_s1 + design.D_s2), 0.5 * (design.D_s2 - design.D_s1)
    profile = mean - half * np.tanh((design.sites - position) / _wall_width(design))
    return design.D_s1 + design.D_s2 - profile if kink else profile


def relax_to_equilibrium(
    material: Material, v: Array, V: Array, *, iterations: int = 200
) -> Array:
    """Return the stable equilibrium displacements v nearest to a guess, with the substrate at V.

    Stuck cells stay as in the guess.

    Newton's method with its matrix shifted until it is positive definite and its step capped
    at a fifth of a lattice constant, so that it goes downhill and stays in its basin.

    Args:
        v: Guess, shape (N,).
        V: Substrate displacements, shape (N,).
        iterations: Bound on the Newton steps.

    Raises:
        StateError: No equilibrium was reached, or only an unstable one.
    """
    specimen = as_specimen(material)
    v = np.array(v, dtype=np.float64)
    held = specimen.stuck_indices
    tolerance = 1e-12  # of the residual force per cell, over the stiffness of the stiffest cell
    for _ in range(iterations):
        force = metamaterial_force(specimen, v, V)
        diagonal = stiffness_diagonal(specimen, v, V)
        force[held] = 0.0
        if np.abs(force).max() < tolerance * diagonal.max():
            if _solve_definite(specimen, diagonal, force) is None:
                why = 'it leads to an unstable equilibrium; move its wall by 0.3 cells'
                raise StateError(ErrorCode.CONFLICT, 'v', reason=why)
            return v
        step = _downhill_step(specimen, diagonal, force)
        v += step * min(1.0, 0.2 / float(np.abs(step).max()))
    why = (
        f'no equilibrium within {iterations} Newton steps; the residual force is '
        f'{np.abs(force).max():.3g}, above {tolerance:g}. Give a guess nearer to one, such as a '
        'wall next to a soft defect, or less scatter; a simulation can also begin with a moving '
        'wall, wall_at(position=..., relaxed=False)'
    )
    raise StateError(ErrorCode.CONFLICT, 'v', reason=why)


DEFECT_OFFSET_CELLS = 0.3
"""Distance from a defect, in cells, at which a guess is not balanced on it."""


def guess_position(material: Material, level: int) -> float:
    """Return a position in sites next to the defect of a level, from which a wall finds it.

    Raises:
        StateError: There is no such level.
    """
    design = as_design(material)
    if level not in range(design.levels):
        levels = f'from 0 to {design.levels - 1}' if design.levels else 'left out: there are none'
        raise StateError.out_of_range('level', level, levels)
    return design.defect_site(level) + DEFECT_OFFSET_CELLS


def find_pinned_wall(material: Material, level: int) -> Array:
    """Return the displacements of an unstrained element with its wall pinned at a level.

    Returns:
        v_j, shape (N,): with no strain it is also the configuration.

    Raises:
        StateError: There is no such level, or its defect does not pin the wall.
    """
    specimen = as_specimen(material)
    design = specimen.design
    guess = wall_profile(design, guess_position(design, level)) + specimen.offsets
    v = relax_to_equilibrium(specimen, guess, np.zeros(design.N))
    found, defect = find_walls(design, v), design.defect_site(level)
    if len(found) != 1 or abs(found[0].position - defect) > _wall_width(design):
        left = ', '.join(f'one at {wall.position:.4g}' for wall in found) or 'none'
        expected = (
            f'one that pins a wall: at its defect, j = {defect}, {left} remains. Softer defects '
            '(a lesser beta) or a flatter gradient (gamma) pin one'
        )
        raise StateError(ErrorCode.UNSUPPORTED, 'level', level, expected)
    return v


def find_pinned_walls(
    material: Material, positions: Sequence[float], *, iterations: int = 200
) -> Array:
    """Return the displacements of an unstrained element with walls and kinks in turn, where they
    come to rest from some positions. Stuck cells are in the phase of their place.

    Args:
        positions: In sites.
        iterations: As `relax_to_equilibrium`: a wall that is pinned where it is takes few.

    Raises:
        StateError: As `relax_to_equilibrium`.
    """
    specimen = as_specimen(material)
    design = specimen.design
    share = np.zeros(design.N)  # of the active phase
    step = design.D_s2 - design.D_s1
    for phase, position in enumerate(sorted(positions, reverse=True), 1):
        left = (wall_profile(design, position) - design.D_s1) / step
        share = share * (1.0 - left) + phase % 2 * left
    held = specimen.stuck_indices
    share[held] = np.round(share[held])
    guess = design.D_s1 + step * share + specimen.offsets
    return relax_to_equilibrium(specimen, guess, np.zeros(design.N), iterations=iterations)


def _wall_width(design: Design) -> float:
    """Return the length of a wall's tanh in cells, from the mean on-site stiffness."""
    return 2.0 / math.sqrt(0.5 * (design.k_s1 + design.k_s2))


def _downhill_step(specimen: Specimen, diagonal: Array, force: Array) -> Array:
    """Solve (H + shift) step = force with the least shift of 0, 0.01, 0.04 ... that is definite.

    H is tridiagonal with off-diagonal -k_r; the pivots of the elimination show its signs.
    """
    shift = 0.0
    while True:
        step = _solve_definite(specimen, diagonal + shift, force)
        if step is not None:
            return step
        shift = 4.0 * shift if shift else 0.01


def _solve_definite(specimen: Specimen, diagonal: Array, right: Array) -> Array | None:
    """Solve the tridiagonal system; None if it is not positive definite."""
    solution, diagonal, beside = right[None].copy(), diagonal.copy(), -specimen.k_r
    held = specimen.stuck_indices
    diagonal[held], beside[held], beside[held - 1] = 1.0, 0.0, 0.0
    return solution[0] if solve_tridiagonal(diagonal, beside, solution) else None
