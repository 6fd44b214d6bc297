# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The paper's equations once more, literally, for SciPy: slow, plain and independent.

Nothing here is taken from the library but the symbols of a design and the values of a specimen.
"""

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import solveh_banded

from mlmem.physics import as_specimen


def psi(p, D):
    """Return the on-site potential of page 3; D may be complex."""
    return p.d * (1.0 - np.cos(p.a * (D + p.c) + p.b * (D + p.c) ** 3))


def psi_prime(p, D):
    """Return its derivative by a complex step: exact to rounding, no formula to get wrong."""
    return np.imag(psi(p, np.asarray(D) + 1e-30j)) / 1e-30


def alpha(p):
    """Return alpha_j, site by site from its definition."""
    factor = dict.fromkeys(range(p.J, p.N - p.tail + 1, p.J), 1 + p.beta)
    if p.profile:
        shape = [float(word) for word in p.profile.split()]
        half = len(shape) // 2
        factor = {
            defect + i - half: each
            for defect in range(p.J, p.N - p.tail + 1, p.J)
            for i, each in enumerate(shape)
        }
    last = p.levels * p.J
    return np.array(
        [
            (1 + p.gamma * j) * factor.get(j, 1) * (1 + (p.rise if j > last + p.J / 2 else 0))
            for j in range(1, p.N + 1)
        ]
    )


def s(p):
    """Return s_{j+1/2}, j = 1 ... N - 1, as Eq. (2) is printed."""
    half, slope = p.J_s / 2, 2 * (p.s_max - p.s_min) / p.J_s
    return np.array(
        [slope * abs((j - p.j_0 - half) % p.J_s - half) + p.s_min for j in range(1, p.N)]
    )


def quasi_static(p, factor=1.0):
    """Return V_j for V_N = 1: the interior springs of the bare substrate in balance.

    Args:
        factor: On every spring.
    """
    spring = s(p) * factor
    bands = np.array([np.append(0.0, -spring[1:-1]), spring[:-1] + spring[1:]])
    right = np.zeros(p.N - 2)
    right[-1] = spring[-1]
    return np.concatenate(([0.0], solveh_banded(bands, right), [1.0]))


def forces(p, v, V):
    """Return -dL/dv_j and -dL/dV_j without inertia and damping, from Eqs. (1a) and (1b)."""
    on_site = alpha(p) * psi_prime(p, v - V)
    f, F = -on_site, on_site.copy()
    f[1:] -= v[1:] - v[:-1]
    f[:-1] -= v[:-1] - v[1:]
    F[1:] -= s(p) * (V[1:] - V[:-1])
    F[:-1] -= s(p) * (V[:-1] - V[1:])
    return f, F


def solve(material, state, span, V_N, v_1=None, shake=lambda t: 0.0):
    """Return v, v', V, V' at the end of a span, shape (4, N), by DOP853, a method of order 8.

    Eqs. (1a) and (1b) with V_1 = 0 and V_N(t) prescribed, in the frame of a base that shakes; over
    a rigid substrate V_j is V_N(t) times the quasi-static shape. A function v_1 moves the first
    cell; its velocity is then meaningless. A stuck cell has one coordinate with that under it:
    masses, and all that pulls at both, add up.
    """
    made = as_specimen(material)
    p, held = made.design, np.array(made.stuck, dtype=int) - 1
    spring, amplitude = s(p) * made.s_factor, alpha(p) * made.alpha_factor
    shape, stuck_at = quasi_static(p, made.s_factor), state[0, held] - state[2, held]
    rigid = p.substrate == 'rigid'

    def prescribe(t, rows):
        v, _, V, W = rows
        if rigid:
            V[:] = V_N(t) * shape
            v[held] = stuck_at + V[held]
        V[0], V[-1], W[0], W[-1] = 0.0, V_N(t), 0.0, 0.0
        if v_1 is not None:
            v[0] = v_1(t)
        return rows

    def derivative(t, y):
        v, w, V, W = prescribe(t, y.reshape(4, p.N).copy())
        on_site = amplitude * psi_prime(p, v - V - made.offsets) - made.depth_force
        pull = np.diff(made.k_r * np.diff(v), prepend=0.0, append=0.0) - on_site - made.eta * w
        below = np.diff(spring * np.diff(V), prepend=0.0, append=0.0) + on_site - made.eta * W
        both = (pull + below)[held] / (1.0 + made.masses[held])
        pull = pull / made.masses
        pull[held] = below[held] = both
        pull, below = pull - shake(t), below - shake(t)
        below[:: 1 if rigid else p.N - 1] = 0.0
        return np.concatenate((w, pull, W, below))

    found = solve_ivp(derivative, span, state.ravel(), method='DOP853', rtol=1e-9, atol=1e-11)
    return prescribe(span[1], found.y[:, -1].reshape(4, p.N))


def place(v):
    """Return the state of displacements at rest over an unstrained substrate, shape (4, N)."""
    return np.stack((v, *np.zeros((3, len(v)))))
