# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The explicit integrator of Noh & Bathe, Comput. Struct. 129 (2013) 178: two sub-steps.

Sub-step 1 (length p dt), from displacement U, velocity V, acceleration A:
    U_p = U + a0 V + a1 A
    A_p = accelerations at U_p, with the damping velocity V + a0 A
    V_p = V + a2 (A + A_p)
Sub-step 2 (length (1 - p) dt):
    U'  = U_p + a3 V_p + a4 A_p
    A'  = accelerations at U', with the damping velocity V_p + a3 A_p
    V'  = V_p + a5 A + a6 A_p + a7 A'
A is the acceleration at the START of the step, also in the last line.

The loop is written with the velocities in the middle of the sub-steps. As a1 = a0^2 / 2 and
a4 = a3^2 / 2, a prediction is one such velocity times a0 or a3: with h0 = a0 / 2, h3 = a3 / 2
    U_p = U + a0 (V + h0 A)          w = V_p + h3 A_p          U' = U_p + a3 w
    damping velocities  V + a0 A = (V + h0 A) + h0 A  and  V_p + a3 A_p = w + h3 A_p.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..jit import fma, kernel
from ..potential import Array, on_site
from .arrays import Cells, Chained, Course, displacements, per_cell
from .integrator import Complex, Integrator

P = 0.54
"""The paper's split of the step."""

OMEGA_DT_LIMIT = 3.6
"""Largest omega dt considered stable: the undamped method bifurcates at 2 / p = 3.704."""


class Coefficients(NamedTuple):
    """The eight constants a0 ... a7 of one step size."""

    a0: float
    a1: float
    a2: float
    a3: float
    a4: float
    a5: float
    a6: float
    a7: float


def coefficients(dt: float, p: float = P) -> Coefficients:
    """Return the integration constants of a step.

    Args:
        dt: Step size in time units, positive.
        p: Split, in (0, 1); 1/2 gives two half-step velocity Verlets.

    Returns:
        a0 ... a7 in the notation of Noh & Bathe.
    """
    q1 = (1.0 - 2.0 * p) / (2.0 * p * (1.0 - p))
    q2 = 0.5 - p * q1
    q0 = 0.5 - q1 - q2
    a0 = p * dt
    a3 = (1.0 - p) * dt
    return Coefficients(
        a0, 0.5 * a0 * a0, 0.5 * a0, a3, 0.5 * a3 * a3, q0 * a3, (0.5 + q1) * a3, q2 * a3
    )


@kernel
def advance(
    steps: int,
    chain: Chained,
    substrate: Chained | None,
    cells: Cells,
    course: Course,
    constants: Array,
    ends: Array,
) -> bool:
    """Advance Eq. (1a), and over an elastic substrate Eq. (1b).

    One pass over the cells makes one sub-step: it computes the accelerations at the present
    displacements, corrects the velocities and predicts the next displacements, so that
    everything stays in the first-level cache.

    Args:
        steps: Number of steps.
        chain: u, v, A and the work space u_p, w, A_p of the metamaterial.
        substrate: The same of an elastic substrate, whose two ends belong to the frame and the
            actuator: they are moved, not integrated, and their velocities and accelerations read
            zero. None for a rigid one, V_j = V_N shape_j; the elastic part is then not compiled.
        cells: The element.
        course: What is prescribed, at the end of every sub-step.
        constants: a0 ... a7.
        ends: Out: displacement of the first and the last cell after every step, (2, steps).

    Returns:
        Whether a cell was out of range at a check.
    """
    u, v, A, u_p, w, A_p = chain
    if substrate is not None:
        U, V, B, U_p, W, B_p = substrate
    height, origin, mobility, under, stuck, eta, a, b = cells
    V_N, shake, site, driven, motion, every, low, high = course
    a0, a3, a5, a6, a7 = constants[0], constants[3], constants[5], constants[6], constants[7]
    h0, h3 = 0.5 * a0, 0.5 * a3
    n, strayed = len(v), False

    for j in range(n):
        u_p[j + 1] = fma(a0, fma(h0, A[j], v[j]), u[j + 1])
        if substrate is not None:
            U_p[j + 1] = fma(a0, fma(h0, B[j], V[j]), U[j + 1])
    for k in range(steps):
        # Sub-step 1: from u_p make A_p, w and the next u.
        i = 2 * k
        end, base = V_N[i], shake[i]
        if i < driven:
            u_p[site] = motion[0, i]
        u_p[0] = u_p[1]
        u_p[n + 1] = u_p[n]
        if substrate is not None:
            U_p[1] = 0.0
            U_p[n] = end
        for j in range(n):
            x = u_p[j + 1]
            if substrate is None:
                y = x - fma(end, under[j], origin[j])
            else:
                X = U_p[j + 1]
                y = x - (X + origin[j])
            slope, sine = on_site(height[j], y, a, b)
            pull = fma(-slope, sine, fma(-2.0, x, u_p[j]) + u_p[j + 2])
            pull = fma(-eta, fma(a0, A[j], v[j]), pull)
            acceleration = fma(mobility[j], pull, -base)
            middle = fma(h0 + h3, acceleration, fma(h0, A[j], v[j]))
            A_p[j] = acceleration
            w[j] = middle
            u[j + 1] = fma(a3, middle, x)
            if substrate is not None:
                pull = fma(under[j + 1], U_p[j + 2] - X, -under[j] * (X - U_p[j]))
                pull = fma(-eta, fma(a0, B[j], V[j]), fma(slope, sine, pull))
                acceleration = pull - base
                middle = fma(h0 + h3, acceleration, fma(h0, B[j], V[j]))
                B_p[j] = acceleration
                W[j] = middle
                U[j + 1] = fma(a3, middle, X)
        for j in stuck:
            u[j + 1] = u_p[j + 1]
            w[j] = A_p[j] = 0.0
        if i < driven:
            w[site - 1] = fma(h3, A_p[site - 1], motion[1, i])
        if i + 1 < driven:
            u[site] = motion[0, i + 1]
        elif i < driven:  # released in mid-step: predict from the enforced velocity
            u[site] = fma(a3, w[site - 1], u_p[site])

        # Sub-step 2: from u make A, v and the next u_p.
        end, base = V_N[i + 1], shake[i + 1]
        u[0] = u[1]
        u[n + 1] = u[n]
        if substrate is not None:
            U[1] = 0.0
            U[n] = end
        for j in range(n):
            x = u[j + 1]
            if substrate is None:
                y = x - fma(end, under[j], origin[j])
            else:
                X = U[j + 1]
                y = x - (X + origin[j])
            slope, sine = on_site(height[j], y, a, b)
            pull = fma(-slope, sine, fma(-2.0, x, u[j]) + u[j + 2])
            pull = fma(-eta, fma(h3, A_p[j], w[j]), pull)
            acceleration = fma(mobility[j], pull, -base)
            velocity = fma(a7, acceleration, fma(a6 - h3, A_p[j], fma(a5, A[j], w[j])))
            A[j] = acceleration
            v[j] = velocity
            u_p[j + 1] = fma(a0, fma(h0, acceleration, velocity), x)
            if substrate is not None:
                pull = fma(under[j + 1], U[j + 2] - X, -under[j] * (X - U[j]))
                pull = fma(-eta, fma(h3, B_p[j], W[j]), fma(slope, sine, pull))
                acceleration = pull - base
                velocity = fma(a7, acceleration, fma(a6 - h3, B_p[j], fma(a5, B[j], W[j])))
                B[j] = acceleration
                V[j] = velocity
                U_p[j + 1] = fma(a0, fma(h0, acceleration, velocity), X)
        for j in stuck:
            u_p[j + 1] = u[j + 1]
            v[j] = A[j] = 0.0
        if substrate is not None:
            V[0] = B[0] = V[n - 1] = B[n - 1] = 0.0
        if i + 1 < driven:
            v[site - 1] = motion[1, i + 1]
            u_p[site] = fma(a0, fma(h0, A[site - 1], v[site - 1]), u[site])
        ends[0, k] = u[1]
        ends[1, k] = u[n]
        if (k + 1) % every == 0:
            for j in range(n):
                D = u[j + 1] - (end * under[j] if substrate is None else U[j + 1])
                if not low <= D <= high:  # also true for NaN
                    strayed = True
    return strayed


class NohBathe(Integrator):
    """The paper's method: two sub-steps, second order, with numerical damping of short waves."""

    name = 'noh_bathe'
    nodes = (P, 1.0)
    accurate_step = 0.25  # 12 steps per period of the probe's carrier
    accurate_turn = 0.6
    keeps_accelerations = True
    advance = staticmethod(advance)

    def limit(self, omega: float, eta: float) -> float:
        """Return the largest stable step (see `Integrator`).

        Explicit damping lowers it: x = omega dt / OMEGA_DT_LIMIT has to satisfy
        x^2 + 2 eta dt / OMEGA_DT_LIMIT <= 1.
        """
        return OMEGA_DT_LIMIT / omega * (math.hypot(omega, eta) - eta) / omega

    def arrays(self, n: int) -> Chained:
        """Return u, v, A, u_p, w and A_p (see `Integrator`)."""
        u, u_p = displacements(n), displacements(n)
        return u, per_cell(n), per_cell(n), u_p, per_cell(n), per_cell(n)

    def constants(self, dt: float, mobility: Array, eta: float) -> Array:
        """Return a0 ... a7 (see `Integrator`)."""
        return np.array(coefficients(dt))

    def step_matrix(self, stiffness: Complex, eta: float, dt: float) -> Complex:
        """Return the matrix of a step on (U, V, A), shape (m, 3, 3) (see `Integrator`)."""
        a0, a1, a2, a3, a4, a5, a6, a7 = coefficients(dt)
        U, V, A = np.eye(3, dtype=np.complex128)[:, None, :] * np.ones((len(stiffness), 1))
        k = stiffness[:, None]
        U_p = U + a0 * V + a1 * A
        A_p = -k * U_p - eta * (V + a0 * A)
        V_p = V + a2 * (A + A_p)
        U_n = U_p + a3 * V_p + a4 * A_p
        A_n = -k * U_n - eta * (V_p + a3 * A_p)
        V_n = V_p + a5 * A + a6 * A_p + a7 * A_n
        return np.stack((U_n, V_n, A_n), axis=1)


NOH_BATHE = NohBathe()
"""The paper's method, and our default."""
