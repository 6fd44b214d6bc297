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
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from .field import aligned
from .integrator import Complex, Integrator
from .noh_bathe_kernel import advance_elastic, advance_rigid
from .potential import Array

P = 0.54
"""The paper's split of the step."""

OMEGA_DT_LIMIT = 3.6
"""Largest omega dt we call stable: the undamped method bifurcates at 2 / p = 3.704."""


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


class NohBathe(Integrator):
    """The paper's method: two sub-steps, of second order; it damps short waves by itself."""

    name = 'noh_bathe'
    nodes = (P, 1.0)
    accurate_step = 0.25  # 12 steps per period of the probe's carrier
    accurate_turn = 0.6
    keeps_accelerations = True
    rigid = staticmethod(advance_rigid)
    elastic = staticmethod(advance_elastic)

    def limit(self, omega: float, eta: float) -> float:
        """Return the largest stable step (see `Integrator`).

        Explicit damping lowers it: x = omega dt / OMEGA_DT_LIMIT has to satisfy
        x^2 + 2 eta dt / OMEGA_DT_LIMIT <= 1.
        """
        return OMEGA_DT_LIMIT / omega * (math.hypot(omega, eta) - eta) / omega

    def work(self, n: int) -> tuple[Array, ...]:
        """Return u_p with ghost cells, w and A_p."""
        return aligned(np.zeros(n + 2), 1), aligned(np.zeros(n)), aligned(np.zeros(n))

    def constants(self, dt: float, mobility: Array, eta: float) -> tuple[Any, ...]:
        """Return mobility, damping and a0 ... a7 (see `Integrator`)."""
        return mobility, eta, np.array(coefficients(dt))

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
"""The method that the paper used, and ours unless another is asked for."""
