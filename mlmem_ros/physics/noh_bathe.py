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

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

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


def squared_frequency(omega: Array, eta: float, dt: float) -> NDArray[np.complex128]:
    """Return the stiffness (unit mass) that a wave of a frequency sees in this scheme.

    A harmonic motion exp(i omega t) solves v'' + eta v' + w v = 0 for w = omega^2 - i eta omega.
    For the scheme's discrete motion the same w is off by its dispersion and its own damping: it
    is that for which exp(i omega dt) is an eigenvalue of the step. Found by secants.

    Args:
        omega: Angular frequencies, shape (m,).
        eta: Damping.
        dt: Step size in time units; 0 gives the exact value.

    Returns:
        w, shape (m,).
    """
    exact: NDArray[np.complex128] = omega**2 - 1j * eta * omega
    if dt == 0.0:
        return exact
    turn = np.exp(1j * omega * dt)
    before, w = exact, exact * (1.0 + 1e-4)
    miss_before, miss = _miss(before, turn, eta, dt), _miss(w, turn, eta, dt)
    for _ in range(12):
        change = miss - miss_before
        moving = np.abs(change) > 1e-300
        step = np.where(moving, miss * (w - before) / np.where(moving, change, 1.0), 0.0)
        before, w, miss_before = w, w - step, miss
        if np.abs(step).max() < 1e-12:
            break
        miss = _miss(w, turn, eta, dt)
    return np.asarray(w)


def _miss(w: NDArray[np.complex128], turn: NDArray[np.complex128], eta: float, dt: float) -> Any:
    """Return det(M(w) - turn), M the matrix of a step on (U, V, A), shape (m,)."""
    a0, a1, a2, a3, a4, a5, a6, a7 = coefficients(dt)
    U, V, A = np.eye(3, dtype=np.complex128)[:, None, :] * np.ones((len(w), 1))
    stiffness = w[:, None]
    U_p = U + a0 * V + a1 * A
    A_p = -stiffness * U_p - eta * (V + a0 * A)
    V_p = V + a2 * (A + A_p)
    U_n = U_p + a3 * V_p + a4 * A_p
    A_n = -stiffness * U_n - eta * (V_p + a3 * A_p)
    V_n = V_p + a5 * A + a6 * A_p + a7 * A_n
    matrix = np.stack((U_n, V_n, A_n), axis=1)
    return np.linalg.det(matrix - turn[:, None, None] * np.eye(3))
