# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""General solvers on the problem of the comparisons, each with its best settings.

A peer is created and compiled once, and then solves from start to end at a setting: a tolerance,
relative and absolute, or a step.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from mlmem_ros.physics.formulas import on_site
from mlmem_ros.physics.jit import kernel
from mlmem_ros.physics.potential import Array

from .problem import Problem

TOLERANCES = tuple(10.0 ** (-0.5 * k) for k in range(6, 25))

RightHandSide = Callable[[float, Array], Array]


class Peer(NamedTuple):
    """A solver that is ready.

    Attributes:
        ladder: Settings, cheapest first.
        solve: From a setting to the displacements at the end, shape (N,).
    """

    ladder: Sequence[float]
    solve: Callable[[float], Array]


@kernel
def _rhs(y: Array, height: Array, eta: float, a: float, b: float, c: float) -> Array:
    """Return d(u, v)/dt: a compiled loop, which a Python solver calls."""
    n = len(height)
    out = np.empty(2 * n)
    for j in range(n):
        x = y[j]
        left = y[j - 1] if j > 0 else x
        right = y[j + 1] if j < n - 1 else x
        slope, sine = on_site((height, a, b), j, x + c)
        out[j] = y[n + j]
        out[n + j] = left - 2.0 * x + right - slope * sine - eta * y[n + j]
    return out


def _compiled(problem: Problem) -> RightHandSide:
    p, height = problem.design, problem.height
    return lambda t, y: _rhs(y, height, p.eta, p.a, p.b, p.c)


def _numpy(problem: Problem) -> RightHandSide:
    """Return the same in plain NumPy."""

    def rhs(t: float, y: Array) -> Array:
        x, velocity = np.split(y, 2)
        return np.concatenate((velocity, problem.force(x) - problem.design.eta * velocity))

    return rhs


def _dop853(right: Callable[[Problem], RightHandSide], problem: Problem, duration: float) -> Peer:
    from scipy.integrate import solve_ivp

    p, rhs = problem.design, right(problem)
    start = np.concatenate((problem.start, np.zeros(p.N)))

    def solve(tolerance: float) -> Array:
        options: dict[str, Any] = {'method': 'DOP853', 'rtol': tolerance, 'atol': tolerance}
        solution = solve_ivp(rhs, (0.0, duration), start, t_eval=[duration], **options)
        return np.asarray(solution.y[: p.N, -1])

    return Peer(TOLERANCES, solve)


PEERS: dict[str, Callable[[Problem, float], Peer]] = {
    'SciPy DOP853': functools.partial(_dop853, _compiled),
    'SciPy DOP853, NumPy': functools.partial(_dop853, _numpy),
}
"""What makes each ready, from the problem and its duration."""
