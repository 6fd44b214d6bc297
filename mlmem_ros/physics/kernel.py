# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The loops: Eqs. (1a) and (1b) advanced by the Noh-Bathe integrator.

One pass over the cells makes one sub-step: it computes the accelerations at the present
displacements, corrects the velocities and predicts the next displacements, so that everything
stays in the first-level cache. Arrays of displacements carry one ghost cell at either end which
repeats its neighbour: a free end needs no branch.

All of it lives in this one file: see `jit.kernel`.
"""

from __future__ import annotations

import math

import numpy as np

from .jit import inlined, kernel
from .potential import Array

PI = math.pi
INVERSE_PI = 1.0 / math.pi

# sin(r) / r as a polynomial in r^2 on [-pi/2, pi/2] (Chebyshev fit in 40 digits): error 1.2e-16.
S0 = 0.9999999999999999
S1 = -0.16666666666666072
S2 = 0.008333333333282756
S3 = -0.00019841269824861897
S4 = 2.7557316609073673e-06
S5 = -2.505188194671259e-08
S6 = 1.6048168318165643e-10
S7 = -7.374387503862757e-13


@inlined
def sine(theta: float) -> float:
    """Return sin(theta) by a vectorisable polynomial.

    The angle is reduced to half a turn, whose parity gives the sign; no branch, no table. The
    rounding of the reduction grows with the angle: the error is below 1e-15 for |theta| < 20
    (ground states 1 to 3), below 1e-13 for |theta| < 640 (all that a design may use).
    """
    n: float = np.rint(theta * INVERSE_PI)
    r = theta - n * PI
    z = r * r
    value = r * (S0 + z * (S1 + z * (S2 + z * (S3 + z * (S4 + z * (S5 + z * (S6 + z * S7)))))))
    half = 0.5 * n
    whole: float = np.floor(half)
    return value * (1.0 - 4.0 * (half - whole))


@inlined
def on_site(configuration: float, a: float, b: float, c: float) -> float:
    """Return psi'(configuration) / d (the potential of page 3)."""
    y = configuration + c
    y2 = y * y
    return sine(y * (a + b * y2)) * (a + 3.0 * b * y2)


@kernel
def rigid_first(
    n: int, u: Array, v: Array, A: Array, u_p: Array, v_p: Array, A_p: Array,
    height: Array, shape: Array, V_N: float, eta: float, a: float, b: float, c: float,
    a0: float, a2: float, a3: float, a4: float,
) -> None:
    """Sub-step 1 over a rigid substrate: from u_p make A_p, v_p and the next u."""
    for j in range(n):
        x = u_p[j + 1]
        force = height[j] * on_site(x - V_N * shape[j], a, b, c)
        acceleration = (u_p[j] - 2.0 * x) + u_p[j + 2] - force - eta * (v[j] + a0 * A[j])
        velocity = v[j] + a2 * (A[j] + acceleration)
        A_p[j] = acceleration
        v_p[j] = velocity
        u[j + 1] = x + a3 * velocity + a4 * acceleration


@kernel
def rigid_second(
    n: int, u: Array, v: Array, A: Array, u_p: Array, v_p: Array, A_p: Array,
    height: Array, shape: Array, V_N: float, eta: float, a: float, b: float, c: float,
    a0: float, a1: float, a3: float, a5: float, a6: float, a7: float,
) -> None:
    """Sub-step 2 over a rigid substrate: from u make A, v and the next u_p."""
    for j in range(n):
        x = u[j + 1]
        force = height[j] * on_site(x - V_N * shape[j], a, b, c)
        acceleration = (u[j] - 2.0 * x) + u[j + 2] - force - eta * (v_p[j] + a3 * A_p[j])
        velocity = v_p[j] + a5 * A[j] + a6 * A_p[j] + a7 * acceleration
        A[j] = acceleration
        v[j] = velocity
        u_p[j + 1] = x + a0 * velocity + a1 * acceleration


@kernel
def advance_rigid(
    steps: int, n: int, u: Array, v: Array, A: Array, u_p: Array, v_p: Array, A_p: Array,
    height: Array, shape: Array, V_N: Array, eta: float, a: float, b: float, c: float,
    site: int, driven: int, drive: Array, ends: Array, constants: Array,
) -> None:
    """Advance Eq. (1a) over the quasi-static substrate V_j = V_N shape_j.

    Args:
        steps: Number of steps.
        n: Number of cells.
        u, v, A: Displacements (n + 2,), velocities (n,), accelerations (n,): the state.
        u_p, v_p, A_p: Work space of the same shapes.
        height: alpha_j d, shape (n,).
        shape: Substrate displacement per unit V_N, shape (n,).
        V_N: Substrate end displacement at the end of every sub-step, shape (2 steps,).
        eta: Damping.
        a, b, c: Potential.
        site: Driven cell, index in u.
        driven: Number of leading sub-steps in which the cell is driven.
        drive: Its displacement and velocity at the end of every sub-step, (2, >= driven).
        ends: Out: displacement of the first and the last cell after every step, (2, steps).
        constants: a0 ... a7.
    """
    a0, a1, a2, a3 = constants[0], constants[1], constants[2], constants[3]
    a4, a5, a6, a7 = constants[4], constants[5], constants[6], constants[7]
    for j in range(n):
        u_p[j + 1] = u[j + 1] + a0 * v[j] + a1 * A[j]
    for k in range(steps):
        i = 2 * k
        if i < driven:
            u_p[site] = drive[0, i]
        u_p[0] = u_p[1]
        u_p[n + 1] = u_p[n]
        rigid_first(
            n, u, v, A, u_p, v_p, A_p, height, shape, V_N[i], eta, a, b, c, a0, a2, a3, a4
        )
        if i < driven:
            v_p[site - 1] = drive[1, i]
        if i + 1 < driven:
            u[site] = drive[0, i + 1]
        elif i < driven:  # let go in mid-step: predict from the enforced velocity
            u[site] = u_p[site] + a3 * v_p[site - 1] + a4 * A_p[site - 1]
        u[0] = u[1]
        u[n + 1] = u[n]
        rigid_second(
            n, u, v, A, u_p, v_p, A_p, height, shape, V_N[i + 1], eta, a, b, c,
            a0, a1, a3, a5, a6, a7,
        )
        if i + 1 < driven:
            v[site - 1] = drive[1, i + 1]
            u_p[site] = u[site] + a0 * v[site - 1] + a1 * A[site - 1]
        ends[0, k] = u[1]
        ends[1, k] = u[n]


@kernel
def elastic_first(
    n: int, u: Array, v: Array, A: Array, u_p: Array, v_p: Array, A_p: Array,
    U: Array, V: Array, B: Array, U_p: Array, V_p: Array, B_p: Array,
    height: Array, s: Array, eta: float, a: float, b: float, c: float,
    a0: float, a2: float, a3: float, a4: float,
) -> None:
    """Sub-step 1 of both chains: from u_p, U_p make A_p, v_p, B_p, V_p and the next u, U."""
    for j in range(n):
        x = u_p[j + 1]
        X = U_p[j + 1]
        force = height[j] * on_site(x - X, a, b, c)
        acceleration = (u_p[j] - 2.0 * x) + u_p[j + 2] - force - eta * (v[j] + a0 * A[j])
        velocity = v[j] + a2 * (A[j] + acceleration)
        A_p[j] = acceleration
        v_p[j] = velocity
        u[j + 1] = x + a3 * velocity + a4 * acceleration
        spring = s[j + 1] * (U_p[j + 2] - X) - s[j] * (X - U_p[j])
        acceleration = spring + force - eta * (V[j] + a0 * B[j])
        velocity = V[j] + a2 * (B[j] + acceleration)
        B_p[j] = acceleration
        V_p[j] = velocity
        U[j + 1] = X + a3 * velocity + a4 * acceleration


@kernel
def elastic_second(
    n: int, u: Array, v: Array, A: Array, u_p: Array, v_p: Array, A_p: Array,
    U: Array, V: Array, B: Array, U_p: Array, V_p: Array, B_p: Array,
    height: Array, s: Array, eta: float, a: float, b: float, c: float,
    a0: float, a1: float, a3: float, a5: float, a6: float, a7: float,
) -> None:
    """Sub-step 2 of both chains: from u, U make A, v, B, V and the next u_p, U_p."""
    for j in range(n):
        x = u[j + 1]
        X = U[j + 1]
        force = height[j] * on_site(x - X, a, b, c)
        acceleration = (u[j] - 2.0 * x) + u[j + 2] - force - eta * (v_p[j] + a3 * A_p[j])
        velocity = v_p[j] + a5 * A[j] + a6 * A_p[j] + a7 * acceleration
        A[j] = acceleration
        v[j] = velocity
        u_p[j + 1] = x + a0 * velocity + a1 * acceleration
        spring = s[j + 1] * (U[j + 2] - X) - s[j] * (X - U[j])
        acceleration = spring + force - eta * (V_p[j] + a3 * B_p[j])
        velocity = V_p[j] + a5 * B[j] + a6 * B_p[j] + a7 * acceleration
        B[j] = acceleration
        V[j] = velocity
        U_p[j + 1] = X + a0 * velocity + a1 * acceleration


@kernel
def advance_elastic(
    steps: int, n: int, u: Array, v: Array, A: Array, u_p: Array, v_p: Array, A_p: Array,
    U: Array, V: Array, B: Array, U_p: Array, V_p: Array, B_p: Array,
    height: Array, s: Array, V_N: Array, eta: float, a: float, b: float, c: float,
    site: int, driven: int, drive: Array, ends: Array, constants: Array,
) -> None:
    """Advance Eqs. (1a) and (1b) with V_1 = 0 and V_N prescribed.

    The two ends of the substrate belong to the frame and the actuator: they are moved, not
    integrated, and their velocities and accelerations read zero.

    Args:
        steps, n, u, v, A, u_p, v_p, A_p, height, eta, a, b, c: As `advance_rigid`.
        U, V, B: Substrate displacements (n + 2,), velocities (n,), accelerations (n,).
        U_p, V_p, B_p: Work space of the same shapes.
        s: Substrate stiffness left of every cell and right of the last, shape (n + 1,).
        V_N: Substrate end displacement at the end of every sub-step, shape (2 steps,).
        site, driven, drive, ends, constants: As `advance_rigid`.
    """
    a0, a1, a2, a3 = constants[0], constants[1], constants[2], constants[3]
    a4, a5, a6, a7 = constants[4], constants[5], constants[6], constants[7]
    for j in range(n):
        u_p[j + 1] = u[j + 1] + a0 * v[j] + a1 * A[j]
        U_p[j + 1] = U[j + 1] + a0 * V[j] + a1 * B[j]
    for k in range(steps):
        i = 2 * k
        if i < driven:
            u_p[site] = drive[0, i]
        u_p[0] = u_p[1]
        u_p[n + 1] = u_p[n]
        U_p[1] = 0.0
        U_p[n] = V_N[i]
        elastic_first(
            n, u, v, A, u_p, v_p, A_p, U, V, B, U_p, V_p, B_p, height, s, eta, a, b, c,
            a0, a2, a3, a4,
        )
        if i < driven:
            v_p[site - 1] = drive[1, i]
        if i + 1 < driven:
            u[site] = drive[0, i + 1]
        elif i < driven:  # let go in mid-step: predict from the enforced velocity
            u[site] = u_p[site] + a3 * v_p[site - 1] + a4 * A_p[site - 1]
        u[0] = u[1]
        u[n + 1] = u[n]
        U[1] = 0.0
        U[n] = V_N[i + 1]
        elastic_second(
            n, u, v, A, u_p, v_p, A_p, U, V, B, U_p, V_p, B_p, height, s, eta, a, b, c,
            a0, a1, a3, a5, a6, a7,
        )
        V[0] = B[0] = V[n - 1] = B[n - 1] = 0.0
        if i + 1 < driven:
            v[site - 1] = drive[1, i + 1]
            u_p[site] = u[site] + a0 * v[site - 1] + a1 * A[site - 1]
        ends[0, k] = u[1]
        ends[1, k] = u[n]
