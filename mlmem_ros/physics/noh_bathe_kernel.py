# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The loops: Eqs. (1a) and (1b) advanced by the Noh-Bathe integrator.

One pass over the cells makes one sub-step: it computes the accelerations at the present
displacements, corrects the velocities and predicts the next displacements, so that everything
stays in the first-level cache. Arrays of displacements carry one ghost cell at either end which
repeats its neighbour: a free end needs no branch.

The corrector is written with the velocities in the middle of the sub-steps. As a1 = a0^2 / 2 and
a4 = a3^2 / 2, a prediction is one such velocity times a0 or a3: with h0 = a0 / 2, h3 = a3 / 2
    U_p = U + a0 (V + h0 A)          w = V_p + h3 A_p          U' = U_p + a3 w
    damping velocities  V + a0 A = (V + h0 A) + h0 A  and  V_p + a3 A_p = w + h3 A_p.

The loops are inlined as text: a call would count the references of its arrays, which takes as
long as 80 cells.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from . import on_site as formula
from .jit import built_on, inlined, kernel
from .on_site import on_site
from .potential import Array

Cells = npt.NDArray[np.int64]


@inlined
def rigid_first(
    n: int, u: Array, v: Array, A: Array, u_p: Array, w: Array, A_p: Array,
    height: Array, offset: Array, mobility: Array, shape: Array, V_N: float, shake: float,
    eta: float, a: float, b: float, c: float,
    a3: float, h0: float, h3: float,
) -> None:
    """Sub-step 1 over a rigid substrate: from u_p make A_p, w and the next u."""
    for j in range(n):
        x = u_p[j + 1]
        force = on_site(height[j], x - (V_N * shape[j] + offset[j]), a, b, c)
        half = h0 * A[j]
        middle = v[j] + half
        pull = (u_p[j] - 2.0 * x) + u_p[j + 2] - eta * (middle + half) - force
        acceleration = mobility[j] * pull - shake
        middle += (h0 + h3) * acceleration
        A_p[j] = acceleration
        w[j] = middle
        u[j + 1] = x + a3 * middle


@inlined
def rigid_second(
    n: int, u: Array, v: Array, A: Array, u_p: Array, w: Array, A_p: Array,
    height: Array, offset: Array, mobility: Array, shape: Array, V_N: float, shake: float,
    eta: float, a: float, b: float, c: float,
    a0: float, a5: float, a6: float, a7: float, h0: float, h3: float,
) -> None:
    """Sub-step 2 over a rigid substrate: from u make A, v and the next u_p."""
    for j in range(n):
        x = u[j + 1]
        force = on_site(height[j], x - (V_N * shape[j] + offset[j]), a, b, c)
        pull = (u[j] - 2.0 * x) + u[j + 2] - eta * (w[j] + h3 * A_p[j]) - force
        acceleration = mobility[j] * pull - shake
        velocity = w[j] + a5 * A[j] + (a6 - h3) * A_p[j] + a7 * acceleration
        A[j] = acceleration
        v[j] = velocity
        u_p[j + 1] = x + a0 * (velocity + h0 * acceleration)


@inlined
def clamp(stuck: Cells, u: Array, u_next: Array, velocity: Array, acceleration: Array) -> None:
    """Leave stuck cells where they are: at the next displacements, too."""
    for k in range(len(stuck)):
        j = stuck[k]
        u_next[j + 1] = u[j + 1]
        velocity[j] = acceleration[j] = 0.0


@built_on(formula)
@kernel
def advance_rigid(
    steps: int, n: int, u: Array, v: Array, A: Array, u_p: Array, w: Array, A_p: Array,
    height: Array, offset: Array, stuck: Cells, shape: Array, V_N: Array, shake: Array,
    a: float, b: float, c: float, site: int, driven: int, drive: Array, ends: Array,
    mobility: Array, eta: float, constants: Array,
) -> None:
    """Advance Eq. (1a) over the quasi-static substrate V_j = V_N shape_j.

    Args:
        steps: Number of steps.
        n: Number of cells.
        u, v, A: Displacements (n + 2,), velocities (n,), accelerations (n,): the state.
        u_p, w, A_p: Work space of the same shapes.
        height: alpha_j d, shape (n,).
        offset: Shift of a cell's ground states, shape (n,).
        stuck: Indices of the cells that do not move relative to the base, whole numbers.
        shape: Substrate displacement per unit V_N, shape (n,).
        V_N: Substrate end displacement at the end of every sub-step, shape (2 steps,).
        shake: Acceleration of the base, in whose frame the chain is, likewise.
        a, b, c: Potential.
        site: Driven cell, index in u.
        driven: Number of leading sub-steps in which the cell is driven.
        drive: Its displacement and velocity at the end of every sub-step, (2, >= driven).
        ends: Out: displacement of the first and the last cell after every step, (2, steps).
        mobility: Inverse of a cell's mass, shape (n,).
        eta: Damping.
        constants: a0 ... a7.
    """
    a0, a3, a5, a6, a7 = constants[0], constants[3], constants[5], constants[6], constants[7]
    h0, h3 = 0.5 * a0, 0.5 * a3
    for j in range(n):
        u_p[j + 1] = u[j + 1] + a0 * (v[j] + h0 * A[j])
    for k in range(steps):
        i = 2 * k
        if i < driven:
            u_p[site] = drive[0, i]
        u_p[0] = u_p[1]
        u_p[n + 1] = u_p[n]
        rigid_first(
            n, u, v, A, u_p, w, A_p, height, offset, mobility, shape, V_N[i], shake[i],
            eta, a, b, c, a3, h0, h3,
        )
        clamp(stuck, u_p, u, w, A_p)
        if i < driven:
            w[site - 1] = drive[1, i] + h3 * A_p[site - 1]
        if i + 1 < driven:
            u[site] = drive[0, i + 1]
        elif i < driven:  # let go in mid-step: predict from the enforced velocity
            u[site] = u_p[site] + a3 * w[site - 1]
        u[0] = u[1]
        u[n + 1] = u[n]
        rigid_second(
            n, u, v, A, u_p, w, A_p, height, offset, mobility, shape, V_N[i + 1], shake[i + 1],
            eta, a, b, c, a0, a5, a6, a7, h0, h3,
        )
        clamp(stuck, u, u_p, v, A)
        if i + 1 < driven:
            v[site - 1] = drive[1, i + 1]
            u_p[site] = u[site] + a0 * (v[site - 1] + h0 * A[site - 1])
        ends[0, k] = u[1]
        ends[1, k] = u[n]


@inlined
def elastic_first(
    n: int, u: Array, v: Array, A: Array, u_p: Array, w: Array, A_p: Array,
    U: Array, V: Array, B: Array, U_p: Array, W: Array, B_p: Array,
    height: Array, offset: Array, mobility: Array, s: Array, shake: float,
    eta: float, a: float, b: float, c: float,
    a3: float, h0: float, h3: float,
) -> None:
    """Sub-step 1 of both chains: from u_p, U_p make A_p, w, B_p, W and the next u, U."""
    for j in range(n):
        x = u_p[j + 1]
        X = U_p[j + 1]
        force = on_site(height[j], x - (X + offset[j]), a, b, c)
        half = h0 * A[j]
        middle = v[j] + half
        pull = (u_p[j] - 2.0 * x) + u_p[j + 2] - eta * (middle + half) - force
        acceleration = mobility[j] * pull - shake
        middle += (h0 + h3) * acceleration
        A_p[j] = acceleration
        w[j] = middle
        u[j + 1] = x + a3 * middle
        spring = s[j + 1] * (U_p[j + 2] - X) - s[j] * (X - U_p[j])
        half = h0 * B[j]
        middle = V[j] + half
        acceleration = spring - eta * (middle + half) + force - shake
        middle += (h0 + h3) * acceleration
        B_p[j] = acceleration
        W[j] = middle
        U[j + 1] = X + a3 * middle


@inlined
def elastic_second(
    n: int, u: Array, v: Array, A: Array, u_p: Array, w: Array, A_p: Array,
    U: Array, V: Array, B: Array, U_p: Array, W: Array, B_p: Array,
    height: Array, offset: Array, mobility: Array, s: Array, shake: float,
    eta: float, a: float, b: float, c: float,
    a0: float, a5: float, a6: float, a7: float, h0: float, h3: float,
) -> None:
    """Sub-step 2 of both chains: from u, U make A, v, B, V and the next u_p, U_p."""
    for j in range(n):
        x = u[j + 1]
        X = U[j + 1]
        force = on_site(height[j], x - (X + offset[j]), a, b, c)
        pull = (u[j] - 2.0 * x) + u[j + 2] - eta * (w[j] + h3 * A_p[j]) - force
        acceleration = mobility[j] * pull - shake
        velocity = w[j] + a5 * A[j] + (a6 - h3) * A_p[j] + a7 * acceleration
        A[j] = acceleration
        v[j] = velocity
        u_p[j + 1] = x + a0 * (velocity + h0 * acceleration)
        spring = s[j + 1] * (U[j + 2] - X) - s[j] * (X - U[j])
        acceleration = spring - eta * (W[j] + h3 * B_p[j]) + force - shake
        velocity = W[j] + a5 * B[j] + (a6 - h3) * B_p[j] + a7 * acceleration
        B[j] = acceleration
        V[j] = velocity
        U_p[j + 1] = X + a0 * (velocity + h0 * acceleration)


@built_on(formula)
@kernel
def advance_elastic(
    steps: int, n: int, u: Array, v: Array, A: Array, u_p: Array, w: Array, A_p: Array,
    U: Array, V: Array, B: Array, U_p: Array, W: Array, B_p: Array,
    height: Array, offset: Array, stuck: Cells, s: Array, V_N: Array, shake: Array,
    a: float, b: float, c: float, site: int, driven: int, drive: Array, ends: Array,
    mobility: Array, eta: float, constants: Array,
) -> None:
    """Advance Eqs. (1a) and (1b) with V_1 = 0 and V_N prescribed.

    The two ends of the substrate belong to the frame and the actuator: they are moved, not
    integrated, and their velocities and accelerations read zero.

    Args:
        steps, n, u, v, A, u_p, w, A_p, height, offset, stuck: As `advance_rigid`.
        U, V, B: Substrate displacements (n + 2,), velocities (n,), accelerations (n,).
        U_p, W, B_p: Work space of the same shapes.
        s: Substrate stiffness left of every cell and right of the last, shape (n + 1,).
        V_N: Substrate end displacement at the end of every sub-step, shape (2 steps,).
        shake, a, b, c, site, driven, drive, ends, mobility, eta, constants: As `advance_rigid`.
    """
    a0, a3, a5, a6, a7 = constants[0], constants[3], constants[5], constants[6], constants[7]
    h0, h3 = 0.5 * a0, 0.5 * a3
    for j in range(n):
        u_p[j + 1] = u[j + 1] + a0 * (v[j] + h0 * A[j])
        U_p[j + 1] = U[j + 1] + a0 * (V[j] + h0 * B[j])
    for k in range(steps):
        i = 2 * k
        if i < driven:
            u_p[site] = drive[0, i]
        u_p[0] = u_p[1]
        u_p[n + 1] = u_p[n]
        U_p[1] = 0.0
        U_p[n] = V_N[i]
        elastic_first(
            n, u, v, A, u_p, w, A_p, U, V, B, U_p, W, B_p, height, offset, mobility, s,
            shake[i], eta, a, b, c, a3, h0, h3,
        )
        clamp(stuck, u_p, u, w, A_p)
        if i < driven:
            w[site - 1] = drive[1, i] + h3 * A_p[site - 1]
        if i + 1 < driven:
            u[site] = drive[0, i + 1]
        elif i < driven:  # let go in mid-step: predict from the enforced velocity
            u[site] = u_p[site] + a3 * w[site - 1]
        u[0] = u[1]
        u[n + 1] = u[n]
        U[1] = 0.0
        U[n] = V_N[i + 1]
        elastic_second(
            n, u, v, A, u_p, w, A_p, U, V, B, U_p, W, B_p, height, offset, mobility, s,
            shake[i + 1], eta, a, b, c, a0, a5, a6, a7, h0, h3,
        )
        clamp(stuck, u, u_p, v, A)
        V[0] = B[0] = V[n - 1] = B[n - 1] = 0.0
        if i + 1 < driven:
            v[site - 1] = drive[1, i + 1]
            u_p[site] = u[site] + a0 * (v[site - 1] + h0 * A[site - 1])
        ends[0, k] = u[1]
        ends[1, k] = u[n]
