# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Two symplectic integrators on our force, to judge the paper's method by.

A kick solves v' = f - eta v exactly at fixed displacements, so that the damping costs no order.
Each pass over the cells makes one kick and drift, as vectorised as the product's kernel.

    velocity Verlet: order 2, one force per step.
    PEFRL: order 4, four forces per step; Omelyan, Mryglod and Folk, Comput. Phys. Commun. 146
        (2002) 188, the position-extended Forest-Ruth-like scheme.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...physics.jit import inlined, kernel
from ...physics.kernel import on_site
from ...physics.potential import Array
from .problem import Problem

_XI, _LAMBDA, _CHI = 0.1786178958448091, -0.2123418310626054, -0.06626458266981849

SCHEMES = {
    'velocity Verlet': ((0.5, 0.5), (1.0,)),
    'PEFRL (order 4)': (
        (_XI, _CHI, 1.0 - 2.0 * (_CHI + _XI), _CHI, _XI),
        (0.5 - _LAMBDA, _LAMBDA, _LAMBDA, 0.5 - _LAMBDA),
    ),
}
"""Shares of the step: the drifts, and the kicks between them."""


@inlined
def _kick_and_drift(
    n: int, u: Array, new: Array, v: Array, height: Array,
    a: float, b: float, c: float, decay: float, kick: float, drift: float,
) -> None:  # fmt: skip
    for j in range(n):
        x = u[j + 1]
        force = (u[j] - 2.0 * x) + u[j + 2] - on_site(height[j], x, a, b, c)
        velocity = decay * v[j] + kick * force
        v[j] = velocity
        new[j + 1] = x + drift * velocity


@kernel
def _advance(
    steps: int, n: int, u: Array, new: Array, v: Array, height: Array,
    a: float, b: float, c: float, first: float, decays: Array, kicks: Array, drifts: Array,
) -> None:  # fmt: skip
    """Advance by whole steps, an even number of kicks in all.

    The last drift of a step is joined to the first of the next one.
    """
    for j in range(n):
        u[j + 1] += first * v[j]
    for _ in range(steps):
        for i in range(len(kicks)):
            u[0] = u[1]
            u[n + 1] = u[n]
            _kick_and_drift(n, u, new, v, height, a, b, c, decays[i], kicks[i], drifts[i])
            u, new = new, u


def solver(problem: Problem, duration: float, scheme: str) -> Callable[[float], Array]:
    """Return a function from the step to the displacements at the end."""
    p, height = problem.design, problem.height
    shares, kick_shares = SCHEMES[scheme]

    def solve(dt: float) -> Array:
        steps = 2 * round(0.5 * duration / dt)
        dt = duration / steps
        drifts = np.array([*shares[1:-1], shares[-1] + shares[0]]) * dt
        decays = np.exp(-p.eta * dt * np.array(kick_shares))
        kicks = (1.0 - decays) / p.eta
        u, new, v = np.zeros(p.N + 2), np.zeros(p.N + 2), np.zeros(p.N)
        u[1:-1] = problem.start
        _advance(
            steps, p.N, u, new, v, height, p.a, p.b, p.c, shares[0] * dt, decays, kicks, drifts
        )
        return u[1:-1] - shares[0] * dt * v

    return solve
