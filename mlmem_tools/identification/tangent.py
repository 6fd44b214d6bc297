# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The tangent-linear run: an element's motion and its derivatives, all of them in one pass.

The stages are those of `physics.pefrl`, over a substrate at rest. The motion is
computed in double precision, the derivatives in single: they need not be exact, because a fit
compares with the motion alone. A row holds the derivatives of one cell's displacement, so that
every loop over them has the same factors and vectorises.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from mlmem.physics.equilibrium import solve_tridiagonal
from mlmem.physics.formulas import INVERSE_TURN, sine_of_turns
from mlmem.physics.jit import compile_kernel, inline_function
from mlmem.physics.pefrl import DRIFT_FRACTIONS, KICK_FRACTIONS
from mlmem.physics.values import Array

from .unknowns import lay_out_cells

Single = NDArray[np.float32]

NO_PATTERNS = np.empty((0, 0))
"""`Material.patterns` where every height changes by itself."""


class Phases(NamedTuple):
    """The paper's potential; its two derivatives are those by a and b."""

    a: float
    b: float


class Spline(NamedTuple):
    """A law of its own (`physics.curve`).

    Its two derivatives are those by the logarithm of its length, stretched about its origin, and
    by its skew (`unknowns.skew_law`).

    Attributes:
        pieces: Of the force, as in `curve.Constants`.
        skew: The same of its derivative by the skew.
        per: Intervals in a unit of length.
    """

    pieces: Array
    skew: Array
    per: float


def _evaluate_phases(law: Any, y: Any) -> Any:
    y2 = y * y
    turns = y * (law.a + law.b * y2) * INVERSE_TURN
    slope = law.a + 3.0 * law.b * y2
    sine, cosine = sine_of_turns(turns), sine_of_turns(turns + 0.25)
    bend = cosine * slope * slope + sine * 6.0 * law.b * y
    by_b = y2 * (cosine * y * slope + 3.0 * sine)
    return sine * slope, bend, cosine * y * slope + sine, by_b


def _evaluate_spline(law: Any, y: Any) -> Any:
    place, p, q = y * law.per, law.pieces, law.skew
    k = int(min(max(place, 0.0), p.shape[1] - 1.0))
    t = place - k
    force = p[0, k] + t * (p[1, k] + t * (p[2, k] + t * p[3, k]))
    bend = law.per * (p[1, k] + t * (2.0 * p[2, k] + t * 3.0 * p[3, k]))
    skew = q[0, k] + t * (q[1, k] + t * (q[2, k] + t * q[3, k]))
    return force, bend, -bend * y, skew


def _evaluate_law(law: Any, y: Any) -> Any:
    """Return the force of a unit height at y, and its derivatives by y and by two of the law."""
    return _evaluate_spline(law, y) if isinstance(law, Spline) else _evaluate_phases(law, y)


@numba.extending.overload(_evaluate_law, inline='always')
def _overload_evaluate_law(law: Any, y: Any) -> Any:
    return _evaluate_spline if law.instance_class is Spline else _evaluate_phases


class Material(NamedTuple):
    """What a run is made with, in the instrument's time.

    Attributes:
        height: alpha_j d, shape (N,).
        origin: Displacement at which theta is zero, shape (N,).
        mass: Shape (N,).
        k_r: Of the springs between the cells, shape (N - 1,).
        origins: Derivatives of the origins by whatever moves them, shape (q, N).
        potential: The law.
        forces: Factor on all forces: the square of the time unit.
        eta: Damping of every cell, shape (N,).
        terms: Of `unknowns.CELL_TERMS`: what derivatives are taken by; damping over its own.
        patterns: Heights that change together, shape (k, N): if there are any, their derivatives,
            which come last, replace those by every height.
    """

    height: Array
    origin: Array
    mass: Array
    k_r: Array
    origins: Array
    potential: Phases | Spline
    forces: float
    eta: Array
    terms: frozenset[str] = frozenset()
    patterns: Array = NO_PATTERNS

    @property
    def height_count(self) -> int:
        """Number of derivatives by every height, which come first."""
        return 0 if len(self.patterns) else len(self.height)

    @property
    def columns(self) -> dict[str, slice]:
        """Columns of the derivatives by the values of cells and springs, by term."""
        return lay_out_cells(self.terms, len(self.height), self.height_count)

    @property
    def first_shared_column(self) -> int:
        """Column of the first derivative that is not by one cell or spring."""
        return int(self.columns['damping'].stop)

    @property
    def first_pattern_column(self) -> int:
        """Column of the first derivative by a pattern.

        Before it stand six by what all cells share: two of the potential (see `Phases` and
        `Spline`), a factor on all forces, damping, dry friction (the motion itself has none), and
        the amplitude of the driven end.
        """
        return self.first_shared_column + len(self.origins) + 6

    @property
    def column_count(self) -> int:
        """Number of derivatives: of cells and springs, by origins, by what all cells share, and by
        patterns.
        """
        return self.first_pattern_column + len(self.patterns)


class Source(NamedTuple):
    """The driven end.

    Attributes:
        site: Its index.
        motion: Its displacement from rest and velocity at the nodes of a step while it is held,
            shape (2, 5 steps).
        amplitude: Factor on the motion.
    """

    site: int
    motion: Array
    amplitude: float


def run_tangent(material: Material, v: Array, source: Source, dt: float, steps: int) -> Single:
    """Return the derivatives of the motion of both ends.

    Args:
        v: Displacements at rest, shape (N,): an equilibrium.
        source: The driven end.
        dt: Step in the instrument's time.

    Returns:
        At rest and after every step, shape (2, steps + 1, columns).
    """
    n, columns = len(v), material.column_count
    U = np.zeros((n, columns + -columns % 16), np.float32)  # a multiple of the widest vector
    U[:, :columns] = solve_equilibrium_derivatives(material, v)
    out = np.zeros((2, steps + 1, U.shape[1]), np.float32)
    springs = np.concatenate(([0.0], material.k_r, [0.0]))
    cells = material.height, material.origin, material.mass, springs, material.eta
    constants = material.potential, material.forces
    masses, offsets, pulls, drags = (
        where.start if term in material.terms else -1 for term, where in material.columns.items()
    )
    patterns = np.reshape(material.patterns, (-1, n)).astype(np.float32)
    _run_steps(
        dt, (v.copy(), np.zeros(n)), (U, U.copy(), np.zeros_like(U)), cells, constants,
        (material.origins, patterns),
        (masses, offsets, pulls, drags, material.first_shared_column), source, out,
        (np.array(DRIFT_FRACTIONS), np.array(KICK_FRACTIONS)),
    )  # fmt: skip
    return out[:, :, :columns]


def solve_equilibrium_derivatives(material: Material, v: Array) -> Array:
    """Return the derivatives of an equilibrium, shape (N, columns)."""
    n, q, first = len(v), len(material.origins), material.first_shared_column
    law = (_evaluate_law(material.potential, y) for y in (v - material.origin).tolist())
    force, bend, by_first, by_second = np.array(list(law)).T
    stiffness = material.height * bend
    pushes = np.zeros((material.column_count, n))
    if material.height_count:
        pushes[:n] = -np.diag(force)
    else:
        pushes[-len(material.patterns) :] = -force * material.patterns
    if 'offsets' in material.terms:
        pushes[material.columns['offsets']] = np.diag(stiffness)
    if 'springs' in material.terms:
        stretch, spring = np.diff(v), np.arange(n - 1)
        at = material.columns['springs'].start + spring
        pushes[at, spring], pushes[at, spring + 1] = stretch, -stretch
    pushes[first : first + q] = stiffness * material.origins
    pushes[first + q] = -material.height * by_first
    pushes[first + q + 1] = -material.height * by_second
    diagonal = stiffness + np.append(material.k_r, 0.0) + np.append(0.0, material.k_r)
    solve_tridiagonal(diagonal, -material.k_r, pushes)
    return pushes.T


@inline_function
def _kick_cells(
    x: Array,
    v: Array,
    h: float,
    cells: tuple[Array, Array, Array, Array, Array],
    constants: tuple[Phases | Spline, float],
    origins: Array,
    local: Single,
    shared: Single,
) -> None:
    """Kick the cells, and find what the kick does to the derivatives.

    Rows of `local`, by cell: the decay of a velocity; the kick of its left neighbour's
    displacement, its own, its right neighbour's, of its height, of its mass, of its origin, of the
    spring left of it, of that right of it. Rows of `shared`: the kicks of everything else.
    """
    height, origin, mass, k_r, eta = cells
    law, forces = constants
    n, q = len(x), len(origins)
    for j in range(n):
        here = x[j]
        left, right = x[max(j - 1, 0)], x[min(j + 1, n - 1)]
        pull, bend, by_first, by_second = _evaluate_law(law, here - origin[j])
        stiffness = height[j] * bend
        from_left, from_right = left - here, right - here
        force = k_r[j] * from_left + k_r[j + 1] * from_right - height[j] * pull
        inverse = 1.0 / mass[j]
        z = eta[j] * h * inverse
        decay = 1.0 - z * (1.0 - z * (0.5 - z * (1.0 / 6.0 - z / 24.0)))
        push = h * inverse * (1.0 - z * (0.5 - z / 6.0))
        kick = push * forces
        local[0, j] = decay
        local[1, j] = kick * k_r[j]
        local[2, j] = -kick * (stiffness + k_r[j] + k_r[j + 1])
        local[3, j] = kick * k_r[j + 1]
        local[4, j] = -kick * pull
        local[5, j] = inverse * (z * v[j] - kick * force)
        local[6, j] = kick * stiffness
        local[7, j] = kick * from_left
        local[8, j] = kick * from_right
        for i in range(q):
            shared[i, j] = kick * stiffness * origins[i, j]
        shared[q, j] = -kick * height[j] * by_first
        shared[q + 1, j] = -kick * height[j] * by_second
        shared[q + 2, j] = push * force
        shared[q + 3, j] = -h * inverse * (v[j] + 0.5 * h * inverse * forces * force)
        shared[q + 4, j] = -push * forces * np.sign(v[j])
        v[j] = decay * v[j] + kick * force


@inline_function
def _carry_derivatives(
    to: Single, w: Single, left: Single, here: Single, right: Single,
    factors: tuple[np.float32, np.float32, np.float32, np.float32], drift: np.float32,
) -> None:  # fmt: skip
    """Kick the rates of a cell's derivatives, and let the derivatives drift."""
    decay, by_left, own, by_right = factors
    for p in range(len(w)):
        rate = decay * w[p] + ((by_left * left[p] + by_right * right[p]) + own * here[p])
        w[p] = rate
        to[p] = here[p] + drift * rate


@compile_kernel
def _run_steps(
    dt: float,
    state: tuple[Array, Array],
    tangents: tuple[Single, Single, Single],
    cells: tuple[Array, Array, Array, Array, Array],
    constants: tuple[Phases | Spline, float],
    together: tuple[Array, Single],
    columns: tuple[int, int, int, int, int],
    source: Source,
    out: Single,
    stages: tuple[Array, Array],
) -> None:
    x, v = state
    U, T, W = tangents
    masses, offsets, springs, damping, first = columns
    (origins, patterns), (site, motion, amplitude) = together, source
    drifts, kicks = stages
    (n, width), q = U.shape, len(origins)
    rest, at_rest = x[site], U[site].copy()
    drive = first + q + 5
    local, shared = np.zeros((9, n), np.float32), np.zeros((q + 5, n), np.float32)
    out[0, 0], out[1, 0] = U[0], U[n - 1]
    for k in range(out.shape[1] - 1):
        held = 5 * (k + 1) <= motion.shape[1]
        drift = np.float32(drifts[0] * dt)
        for j in range(n):
            x[j] += drifts[0] * dt * v[j]
            for p in range(width):
                U[j, p] += drift * W[j, p]
        for stage in range(4):
            if held:
                node = 5 * k + (1 - stage % 2) + stage // 2 * 2
                x[site] = rest + amplitude * motion[0, node]
                U[site] = at_rest
                U[site, drive] += np.float32(motion[0, node])
            _kick_cells(x, v, kicks[stage] * dt, cells, constants, origins, local, shared)
            drift = np.float32(drifts[stage + 1] * dt)
            for j in range(n):
                x[j] += drifts[stage + 1] * dt * v[j]
                left, right = U[max(j - 1, 0)], U[min(j + 1, n - 1)]
                factors = local[0, j], local[1, j], local[2, j], local[3, j]
                _carry_derivatives(T[j], W[j], left, U[j], right, factors, drift)
                if len(patterns) == 0:
                    W[j, j] += local[4, j]
                    T[j, j] += drift * local[4, j]
                for i in range(len(patterns)):
                    pull = local[4, j] * patterns[i, j]
                    W[j, drive + 1 + i] += pull
                    T[j, drive + 1 + i] += drift * pull
                if masses >= 0:
                    W[j, masses + j] += local[5, j]
                    T[j, masses + j] += drift * local[5, j]
                if offsets >= 0:
                    W[j, offsets + j] += local[6, j]
                    T[j, offsets + j] += drift * local[6, j]
                if springs >= 0:
                    for side in range(2):  # the springs left and right of the cell
                        if 0 <= j - 1 + side < n - 1:
                            W[j, springs + j - 1 + side] += local[7 + side, j]
                            T[j, springs + j - 1 + side] += drift * local[7 + side, j]
                if damping >= 0:
                    drag = np.float32(cells[4][j]) * shared[q + 3, j]
                    W[j, damping + j] += drag
                    T[j, damping + j] += drift * drag
                for i in range(q + 5):
                    W[j, first + i] += shared[i, j]
                    T[j, first + i] += drift * shared[i, j]
            U, T = T, U
        if held:
            node = 5 * k + 4
            x[site], v[site] = rest + amplitude * motion[0, node], amplitude * motion[1, node]
            U[site], W[site] = at_rest, np.float32(0.0)
            U[site, drive] += np.float32(motion[0, node])
            W[site, drive] = np.float32(motion[1, node])
        out[0, k + 1], out[1, k + 1] = U[0], U[n - 1]
