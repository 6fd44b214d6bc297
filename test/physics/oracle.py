# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The paper's equations once more, literally, for SciPy: slow, plain and independent.

Nothing here is imported from `mlmem_ros` but the values of a design's symbols.
"""

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import solveh_banded


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


def quasi_static(p):
    """Return V_j for V_N = 1: the interior springs of the bare substrate in balance."""
    spring = s(p)
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


def rigid_rhs(p, V_N, v_1=None):
    """Return d(v, v')/dt of Eq. (1a) over V_j = V_N(t) x quasi-static shape.

    With a function v_1 the first cell is moved by it (its rows are then meaningless).
    """
    shape, amplitude = quasi_static(p), alpha(p)

    def rhs(t, y):
        v, velocity = y[: p.N].copy(), y[p.N :]
        if v_1 is not None:
            v[0] = v_1(t)
        padded = np.concatenate(([v[0]], v, [v[-1]]))  # free ends
        pull = 2 * v - padded[2:] - padded[:-2]
        on_site = amplitude * psi_prime(p, v - V_N(t) * shape)
        return np.concatenate((velocity, -p.eta * velocity - pull - on_site))

    return rhs


def elastic_rhs(p, V_N, v_1=None):
    """Return d(v, v', V, V')/dt of Eqs. (1a) and (1b) with V_1 = 0 and V_N(t) prescribed."""
    spring, amplitude = s(p), alpha(p)

    def rhs(t, y):
        v, velocity, V, speed = (part.copy() for part in np.split(y, 4))
        V[0], V[-1] = 0.0, V_N(t)
        if v_1 is not None:
            v[0] = v_1(t)
        padded = np.concatenate(([v[0]], v, [v[-1]]))
        on_site = amplitude * psi_prime(p, v - V)
        acceleration = -p.eta * velocity - (2 * v - padded[2:] - padded[:-2]) - on_site
        tension = spring * np.diff(V)
        inner = tension[1:] - tension[:-1] + on_site[1:-1] - p.eta * speed[1:-1]
        zero = [0.0]
        speed[0] = speed[-1] = 0.0
        return np.concatenate((velocity, acceleration, speed, zero, inner, zero))

    return rhs


def solve(rhs, y, span, **options):
    """Return the state at the end of a span by DOP853, an explicit method of order 8."""
    options = {'method': 'DOP853', 'rtol': 1e-9, 'atol': 1e-11} | options
    return solve_ivp(rhs, span, y, **options).y[:, -1]


def smooth(x):
    """Return a step from 0 (x <= 0) to 1 (x >= 1) with two continuous derivatives."""
    x = np.clip(x, 0.0, 1.0)
    return x**3 * (10.0 - 15.0 * x + 6.0 * x * x)
