# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Velocity Verlet on our force, as a reference for our integrators: order 2, one force per step.

A kick solves v' = f - eta v exactly at fixed displacements. Each pass over the cells makes one
kick and one drift (the half drifts of two steps are joined), as vectorised as our own kernels.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from mlmem_ros.physics.formulas import on_site
from mlmem_ros.physics.jit import fma, inlined, kernel
from mlmem_ros.physics.potential import Array

from .problem import Problem


@inlined
def _kick_and_drift(
    n: int, u: Array, new: Array, v: Array, height: Array,
    a: float, b: float, c: float, decay: float, kick: float, drift: float,
) -> None:  # fmt: skip
    for j in range(n):
        x = u[j + 1]
        slope, sine = on_site((height, a, b), j, x + c)
        force = fma(-slope, sine, fma(-2.0, x, u[j]) + u[j + 2])
        velocity = fma(decay, v[j], kick * force)
        v[j] = velocity
        new[j + 1] = fma(drift, velocity, x)


@kernel
def _advance(
    pairs: int, n: int, u: Array, new: Array, v: Array, height: Array,
    a: float, b: float, c: float, decay: float, kick: float, drift: float,
) -> None:  # fmt: skip
    """Advance by pairs of steps, from the middle of one drift to the middle of another."""
    for j in range(n):
        u[j + 1] += 0.5 * drift * v[j]
    for _ in range(pairs):
        u[0] = u[1]
        u[n + 1] = u[n]
        _kick_and_drift(n, u, new, v, height, a, b, c, decay, kick, drift)
        new[0] = new[1]
        new[n + 1] = new[n]
        _kick_and_drift(n, new, u, v, height, a, b, c, decay, kick, drift)
    for j in range(n):
        u[j + 1] -= 0.5 * drift * v[j]


def verlet(problem: Problem, duration: float) -> Callable[[float], Array]:
    """Return a function from the step to the displacements at the end."""
    p, height = problem.design, problem.height

    def solve(dt: float) -> Array:
        pairs = round(0.5 * duration / dt)
        dt = 0.5 * duration / pairs
        decay = math.exp(-p.eta * dt)
        u, new, v = np.zeros(p.N + 2), np.zeros(p.N + 2), np.zeros(p.N)
        u[1:-1] = problem.start
        kick = (1.0 - decay) / p.eta
        _advance(pairs, p.N, u, new, v, height, p.a, p.b, p.c, decay, kick, dt)
        return u[1:-1]

    return solve
