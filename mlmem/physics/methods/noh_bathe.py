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

import numpy as np

from ..formulas import coupling_pull, dry_friction, join_motion, on_site_factors
from ..jit import compile_kernel, fma
from ..values import Array, Complex
from .integrator import (
    Cells,
    Chained,
    Forcing,
    Integrator,
    is_below_speed,
    make_cell_array,
    make_displacements,
)

P = 0.54
"""The paper's split of the step."""


def compute_coefficients(dt: float) -> Array:
    """Return the constants a0 ... a7 of a step of dt > 0 in the notation of Noh & Bathe, (8,)."""
    q1 = (1.0 - 2.0 * P) / (2.0 * P * (1.0 - P))
    q2 = 0.5 - P * q1
    q0 = 0.5 - q1 - q2
    a0 = P * dt
    a3 = (1.0 - P) * dt
    a1, a2, a4 = 0.5 * a0 * a0, 0.5 * a0, 0.5 * a3 * a3
    return np.array([a0, a1, a2, a3, a4, q0 * a3, (0.5 + q1) * a3, q2 * a3])


@compile_kernel
def advance(
    steps: int,
    chain: Chained,
    substrate: Chained | None,
    cells: Cells,
    forcing: Forcing,
    constants: Array,
    ends: Array,
    friction: tuple[float, float] | None,
    drag: Array | None,
) -> tuple[int, bool]:
    """Advance Eq. (1a), and over an elastic substrate Eq. (1b).

    One pass over the cells makes one sub-step: it computes the accelerations at the present
    displacements, corrects the velocities and predicts the next displacements, so that
    everything stays in the first-level cache.

    Args:
        chain: u, du, ddu and the work space u_p, du_p, ddu_p of the metamaterial.
        substrate: The same of an elastic substrate, whose two ends belong to the frame and the
            actuator: they are moved, not integrated, and their velocities and accelerations read
            zero. None for a rigid one, V_j = V_N shape_j; the elastic part is then not compiled.
        forcing: What is prescribed, at the end of every sub-step.
        ends: Out: displacement of the first and the last cell after every step, (2, steps).
        friction: Force and creep of dry friction; None for none, which is then not compiled.
        drag: eta times the velocity of the substrate's end, at the end of every sub-step, where
            damping acts on the motion relative to a rigid substrate; None where it acts on v,
            which is then not compiled.

    Returns:
        The number of steps done, and whether a cell was out of range at a check.
    """
    u, du, ddu, u_p, du_p, ddu_p = chain
    if substrate is not None:
        U, dU, ddU, U_p, dU_p, ddU_p = substrate
    law, spring, origin, mobility, under, stuck, eta = cells
    V_N, shake, site, driven, motion, every, low, high, limit, before = forcing
    a0, a3, a5, a6, a7 = constants[0], constants[3], constants[5], constants[6], constants[7]
    h0, h3 = 0.5 * a0, 0.5 * a3
    n, done, strayed = len(du), steps, False

    for j in range(n):
        u_p[j + 1] = fma(a0, fma(h0, ddu[j], du[j]), u[j + 1])
        if substrate is not None:
            U_p[j + 1] = fma(a0, fma(h0, ddU[j], dU[j]), U[j + 1])
    for k in range(steps):
        # Sub-step 1: from u_p make ddu_p, du_p and the next u.
        i = 2 * k
        end, base = V_N[i], shake[i]
        if i < driven:
            u_p[site] = motion[0, i]
        u_p[0] = u_p[1]
        u_p[n + 1] = u_p[n]
        if substrate is not None:
            U_p[1] = 0.0
            U_p[n] = end
        else:
            for j in stuck:
                u_p[j + 1] = fma(end - before, under[j], u_p[j + 1])
        before = end
        for j in range(n):
            x = u_p[j + 1]
            if substrate is None:
                y = x - fma(end, under[j], origin[j])
            else:
                X = U_p[j + 1]
                y = x - (X + origin[j])
            slope, sine = on_site_factors(law, j, y)
            pull = fma(-slope, sine, coupling_pull(spring, j, u_p[j], x, u_p[j + 2]))
            pull = fma(-eta, fma(a0, ddu[j], du[j]), pull)
            if drag is not None:
                pull = fma(drag[i], under[j], pull)
            if friction is not None:
                pull = pull - dry_friction(friction, fma(a0, ddu[j], du[j]))
            acceleration = fma(mobility[j], pull, -base)
            middle = fma(h0 + h3, acceleration, fma(h0, ddu[j], du[j]))
            ddu_p[j] = acceleration
            du_p[j] = middle
            u[j + 1] = fma(a3, middle, x)
            if substrate is not None:
                pull = fma(under[j + 1], U_p[j + 2] - X, -under[j] * (X - U_p[j]))
                pull = fma(-eta, fma(a0, ddU[j], dU[j]), fma(slope, sine, pull))
                acceleration = pull - base
                middle = fma(h0 + h3, acceleration, fma(h0, ddU[j], dU[j]))
                ddU_p[j] = acceleration
                dU_p[j] = middle
                U[j + 1] = fma(a3, middle, X)
        for j in stuck:
            if substrate is None:
                u[j + 1] = u_p[j + 1]
                du_p[j] = ddu_p[j] = 0.0
            else:
                ddu_p[j] = ddU_p[j] = join_motion(mobility[j], ddu_p[j], ddU_p[j])
                du_p[j] = dU_p[j] = join_motion(mobility[j], du_p[j], dU_p[j])
                u[j + 1] = fma(a3, du_p[j], u_p[j + 1])
                U[j + 1] = fma(a3, du_p[j], U_p[j + 1])
        if i < driven:
            du_p[site - 1] = fma(h3, ddu_p[site - 1], motion[1, i])
        if i + 1 < driven:
            u[site] = motion[0, i + 1]
        elif i < driven:  # released in mid-step: predict from the enforced velocity
            u[site] = fma(a3, du_p[site - 1], u_p[site])

        # Sub-step 2: from u make ddu, du and the next u_p.
        end, base = V_N[i + 1], shake[i + 1]
        u[0] = u[1]
        u[n + 1] = u[n]
        if substrate is not None:
            U[1] = 0.0
            U[n] = end
        else:
            for j in stuck:
                u[j + 1] = fma(end - before, under[j], u[j + 1])
        before = end
        for j in range(n):
            x = u[j + 1]
            if substrate is None:
                y = x - fma(end, under[j], origin[j])
            else:
                X = U[j + 1]
                y = x - (X + origin[j])
            slope, sine = on_site_factors(law, j, y)
            pull = fma(-slope, sine, coupling_pull(spring, j, u[j], x, u[j + 2]))
            pull = fma(-eta, fma(h3, ddu_p[j], du_p[j]), pull)
            if drag is not None:
                pull = fma(drag[i + 1], under[j], pull)
            if friction is not None:
                pull = pull - dry_friction(friction, fma(h3, ddu_p[j], du_p[j]))
            acceleration = fma(mobility[j], pull, -base)
            velocity = fma(a7, acceleration, fma(a6 - h3, ddu_p[j], fma(a5, ddu[j], du_p[j])))
            ddu[j] = acceleration
            du[j] = velocity
            u_p[j + 1] = fma(a0, fma(h0, acceleration, velocity), x)
            if substrate is not None:
                pull = fma(under[j + 1], U[j + 2] - X, -under[j] * (X - U[j]))
                pull = fma(-eta, fma(h3, ddU_p[j], dU_p[j]), fma(slope, sine, pull))
                acceleration = pull - base
                velocity = fma(a7, acceleration, fma(a6 - h3, ddU_p[j], fma(a5, ddU[j], dU_p[j])))
                ddU[j] = acceleration
                dU[j] = velocity
                U_p[j + 1] = fma(a0, fma(h0, acceleration, velocity), X)
        for j in stuck:
            if substrate is None:
                u_p[j + 1] = u[j + 1]
                du[j] = ddu[j] = 0.0
            else:
                ddu[j] = ddU[j] = join_motion(mobility[j], ddu[j], ddU[j])
                du[j] = dU[j] = join_motion(mobility[j], du[j], dU[j])
                u_p[j + 1] = fma(a0, fma(h0, ddu[j], du[j]), u[j + 1])
                U_p[j + 1] = fma(a0, fma(h0, ddu[j], du[j]), U[j + 1])
        if substrate is not None:
            dU[0] = ddU[0] = dU[n - 1] = ddU[n - 1] = 0.0
        if i + 1 < driven:
            du[site - 1] = motion[1, i + 1]
            u_p[site] = fma(a0, fma(h0, ddu[site - 1], du[site - 1]), u[site])
        ends[0, k] = u[1]
        ends[1, k] = u[n]
        if (k + 1) % every == 0:
            for j in range(n):
                D = u[j + 1] - (end * under[j] if substrate is None else U[j + 1])
                if not low <= D <= high:  # also true for NaN
                    strayed = True
            calm = is_below_speed(du, limit)
            if substrate is not None:
                calm = calm and is_below_speed(dU, limit)
            if calm:
                done = k + 1
                break
    return done, strayed


class NohBathe(Integrator):
    """The paper's method: two sub-steps, second order, with numerical damping of short waves."""

    name = 'noh_bathe'
    nodes = (P, 1.0)
    accurate_step = 0.25  # 12 steps per period of the probe's carrier
    accurate_turn = 0.6
    stable_turn = 3.6  # undamped it bifurcates at 2 / p = 3.704
    keeps_accelerations = True
    advance = staticmethod(advance)

    def limit(self, omega: float, eta: float) -> float:
        """Return the largest stable step (see `Integrator`).

        Explicit damping lowers it: x = omega dt / stable_turn has to satisfy
        x^2 + 2 eta dt / stable_turn <= 1.
        """
        return self.stable_turn / omega * (math.hypot(omega, eta) - eta) / omega

    def make_arrays(self, n: int) -> Chained:
        """Return u, du, ddu, u_p, du_p and ddu_p (see `Integrator`)."""
        now, between = (
            (make_displacements(n), make_cell_array(n), make_cell_array(n)) for _ in range(2)
        )
        return now + between

    def constants(self, dt: float, mobility: Array, eta: Array | float) -> Array:
        """Return a0 ... a7 (see `Integrator`)."""
        return compute_coefficients(dt)

    def step_matrix(self, stiffness: Complex, eta: float, dt: float) -> Complex:
        """Return the matrix of a step on (U, dU, ddU), shape (m, 3, 3) (see `Integrator`)."""
        a0, a1, a2, a3, a4, a5, a6, a7 = compute_coefficients(dt)
        U, dU, ddU = np.eye(3, dtype=np.complex128)[:, None, :] * np.ones((len(stiffness), 1))
        k = stiffness[:, None]
        U_p = U + a0 * dU + a1 * ddU
        ddU_p = -k * U_p - eta * (dU + a0 * ddU)
        dU_p = dU + a2 * (ddU + ddU_p)
        U_n = U_p + a3 * dU_p + a4 * ddU_p
        ddU_n = -k * U_n - eta * (dU_p + a3 * ddU_p)
        dU_n = dU_p + a5 * ddU + a6 * ddU_p + a7 * ddU_n
        return np.stack((U_n, dU_n, ddU_n), axis=1)


NOH_BATHE = NohBathe()
"""The paper's method."""
