# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Our integrators compared with general solvers, at equal error on the same problem.

Every solver is given a ladder of settings (tolerance or step) and takes part with the cheapest
one whose greatest error of a displacement, against DOP853 at a tolerance of 1e-13, is at most
the target. Two targets: the error of our default step, and a hundredth of it.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence

import numpy as np

from ..physics import NOH_BATHE, PEFRL, Chain, Integrator
from ..physics.potential import Array
from .comparison import Comparison
from .measure import Contender, measure
from .peers import PEERS, Missing, Solve
from .problem import STEP, Problem
from .verlet import verlet

TITLE = 'milliseconds at equal error compared with SciPy, heyoka, diffrax and MuJoCo'

DURATION = 200.0
"""Time units of the problem: the packet has run into the wall."""

LADDER = tuple(STEP / 2 ** (0.25 * k) for k in range(21))
"""Steps of the methods of second order, ours and Verlet's."""

LONGER = tuple(1.3 / 2 ** (0.25 * k) for k in range(21))
"""Those of our fourth-order method, from the longest that is stable."""

OURS = 'ours, Noh-Bathe'
"""The reference for all others: the paper's method at its step."""


def run(repeats: int) -> list[Comparison]:
    """Measure at the error of our default step and at a hundredth of it."""
    problem = Problem.of_size(225)
    reference = PEERS['SciPy DOP853'](problem, DURATION).solve(1e-13)
    ladders: dict[str, tuple[Sequence[float], Solve]] = {
        OURS: (LADDER, _ours(problem, NOH_BATHE)),
        'ours, PEFRL': (LONGER, _ours(problem, PEFRL)),
        'velocity Verlet': (LADDER, verlet(problem, DURATION)),
    }
    skipped = {'numbalsoda': 'has no wheel; its source needs a Fortran compiler'}
    for name, peer in PEERS.items():
        try:
            made = peer(problem, DURATION)
        except Missing as error:
            skipped[name] = str(error)
        else:
            ladders[name] = made.ladder, made.solve
    errors = {
        name: [_error(solve(setting), reference) for setting in settings]
        for name, (settings, solve) in ladders.items()
    }
    default = errors[OURS][0]
    return [
        _at(target, label, ladders, errors, skipped, repeats)
        for target, label in ((default, 'default'), (0.01 * default, 'hundredth'))
    ]


def _at(
    target: float,
    label: str,
    ladders: dict[str, tuple[Sequence[float], Solve]],
    errors: dict[str, list[float]],
    skipped: dict[str, str],
    repeats: int,
) -> Comparison:
    contenders, skipped = [], dict(skipped)
    for name, (settings, solve) in ladders.items():
        good = [i for i, error in enumerate(errors[name]) if error <= 1.001 * target]
        if not good:
            skipped[name] = f'reached {min(errors[name]):.1e} only'
            continue
        setting = settings[good[0]]  # ladders begin with the cheapest
        values = {'setting': setting, 'error': errors[name][good[0]]}
        contenders.append(Contender(name, functools.partial(solve, setting), 1.0, values=values))
    return Comparison(
        f'solvers_{label}',
        f'{DURATION:g} time units of a wall and a packet, N = 225, error at most {target:.1e}',
        'ms',
        __doc__.split('\n\n')[1].replace('\n', ' ') if __doc__ else '',
        measure(contenders, repeats, scale=1e3),
        skipped,
    )


def _ours(problem: Problem, integrator: Integrator) -> Solve:
    @functools.cache
    def chain(steps: int) -> Chain:
        return problem.chain(dt=DURATION / steps, integrator=integrator)

    def solve(dt: float) -> Array:
        steps = round(DURATION / dt)
        chain(steps).place(problem.start)
        chain(steps).rest(steps)
        return chain(steps).v.copy()

    return solve


def _error(solution: Array, reference: Array) -> float:
    error = float(np.abs(solution - reference).max())
    return error if np.isfinite(error) else np.inf
