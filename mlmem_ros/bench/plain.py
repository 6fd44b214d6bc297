# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The same steps written naively: vectorised NumPy, and a numba loop with math.sin."""

from __future__ import annotations

import math

import numba
import numpy as np

from ..physics.potential import Array
from .problem import STEP, Problem, Runner, constants


def numpy_runner(problem: Problem) -> Runner:
    """Return whole-array expressions on a problem."""
    p, height = problem.design, problem.height
    a0, a1, a2, a3, a4, a5, a6, a7 = constants(STEP)
    u, v, A = problem.start.copy(), np.zeros(p.N), problem.arrays().A

    def acceleration(u: Array) -> Array:
        force = -problem.on_site(u, height, np.sin)
        stretch = np.diff(u)
        force[:-1] += stretch
        force[1:] -= stretch
        return np.asarray(force)

    def advance(steps: int) -> None:
        nonlocal u, v, A
        for _ in range(steps):
            u_p = u + a0 * v + a1 * A
            A_p = acceleration(u_p) - p.eta * (v + a0 * A)
            v_p = v + a2 * (A + A_p)
            u = u_p + a3 * v_p + a4 * A_p
            A_new = acceleration(u) - p.eta * (v_p + a3 * A_p)
            v = v_p + a5 * A + a6 * A_p + a7 * A_new
            A = A_new

    return Runner(advance, lambda: u)


def numba_runner(problem: Problem) -> Runner:
    """Return a compiled loop with libm's sine on a problem."""
    p, arrays, k = problem.design, problem.arrays(), constants(STEP)
    height = problem.height

    def advance(steps: int) -> None:
        _loop(steps, p.N, *arrays, height, p.eta, p.a, p.b, p.c, k)

    return Runner(advance, lambda: arrays.u[1:-1])


@numba.njit(error_model='numpy')
def _loop(
    steps: int, n: int, u: Array, v: Array, A: Array, u_p: Array, v_p: Array, A_p: Array,
    height: Array, eta: float, a: float, b: float, c: float, k: Array,
) -> None:  # fmt: skip
    for _ in range(steps):
        for j in range(1, n + 1):
            u_p[j] = u[j] + k[0] * v[j - 1] + k[1] * A[j - 1]
        u_p[0] = u_p[1]
        u_p[n + 1] = u_p[n]
        for j in range(n):
            x = u_p[j + 1]
            y = x + c
            force = height[j] * math.sin(y * (a + b * y * y)) * (a + 3.0 * b * y * y)
            A_p[j] = u_p[j] - 2.0 * x + u_p[j + 2] - force - eta * (v[j] + k[0] * A[j])
            v_p[j] = v[j] + k[2] * (A[j] + A_p[j])
            u[j + 1] = x + k[3] * v_p[j] + k[4] * A_p[j]
        u[0] = u[1]
        u[n + 1] = u[n]
        for j in range(n):
            x = u[j + 1]
            y = x + c
            force = height[j] * math.sin(y * (a + b * y * y)) * (a + 3.0 * b * y * y)
            new = u[j] - 2.0 * x + u[j + 2] - force - eta * (v_p[j] + k[3] * A_p[j])
            v[j] = v_p[j] + k[5] * A[j] + k[6] * A_p[j] + k[7] * new
            A[j] = new
