# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Our integrators compared with general solvers, at equal error on the same problem.

Every solver has a ladder of settings (tolerances or steps) and competes with the cheapest one
whose greatest error of a displacement, against DOP853 at a tolerance of 1e-13, is at most the
target. There are two targets: the error of our default step, and a hundredth of it.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable

import numpy as np

from mlmem_ros.physics import NOH_BATHE, PEFRL, Chain, Integrator
from mlmem_ros.physics.potential import Array
from mlmem_ros.physics.specimen import Specimen
from mlmem_ros.physics.stepping import stable_step

from .measure import Comparison, Contender, measure
from .peers import PEERS, Peer, verlet
from .problem import STEP, Problem

TITLE = 'milliseconds at equal error compared with SciPy, heyoka, diffrax and MuJoCo'

DURATION = 200.0
"""Time units of the problem: the packet has run into the wall."""

OURS = 'ours, Noh-Bathe'
"""The reference for all others: the paper's method at its step."""


def run(repeats: int) -> list[Comparison]:
    """Measure at the error of our default step and at a hundredth of it."""
    problem = Problem.of_size(225)
    reference = PEERS['SciPy DOP853'](problem, DURATION).solve(1e-13)
    peers, skipped = entrants(problem)
    errors = {
        name: [_error(peer.solve(setting), reference) for setting in peer.ladder]
        for name, peer in peers.items()
    }
    default = errors[OURS][0]
    return [
        _at(target, label, peers, errors, skipped, repeats)
        for target, label in ((default, 'default'), (0.01 * default, 'hundredth'))
    ]


def entrants(problem: Problem) -> tuple[dict[str, Peer], dict[str, str]]:
    """Return all solvers by name, ours first, and why others do not take part."""
    longest = stable_step(Specimen(problem.design), PEFRL)
    peers = {
        OURS: Peer(_ladder(STEP), _ours(problem, NOH_BATHE)),
        'ours, PEFRL': Peer(_ladder(longest), _ours(problem, PEFRL)),
        'velocity Verlet': Peer(_ladder(STEP), verlet(problem, DURATION)),
    }
    skipped = {}
    for name, make in PEERS.items():
        try:
            peers[name] = make(problem, DURATION)
        except ModuleNotFoundError as error:
            skipped[name] = f'{error.name} is not installed: pip install "mlmem_lab[bench]"'
    return peers, skipped


def _ladder(longest: float) -> tuple[float, ...]:
    """Return steps from the longest of which a whole number makes up the duration."""
    first = DURATION / math.ceil(DURATION / longest)
    return tuple(first / 2 ** (0.25 * k) for k in range(21))


def _at(
    target: float,
    label: str,
    peers: dict[str, Peer],
    errors: dict[str, list[float]],
    skipped: dict[str, str],
    repeats: int,
) -> Comparison:
    contenders, skipped = [], dict(skipped)
    for name, peer in peers.items():
        good = [each for each in zip(peer.ladder, errors[name], strict=True)
                if each[1] <= 1.001 * target]  # fmt: skip
        if not good:
            skipped[name] = f'reached only {min(errors[name]):.1e}'
            continue
        setting, error = good[0]  # ladders begin with the cheapest
        values = {'setting': setting, 'error': error}
        contenders.append(Contender(name, functools.partial(peer.solve, setting), 1.0, values))
    return Comparison(
        f'solvers_{label}',
        f'{DURATION:g} time units of a wall and a packet, N = 225, error at most {target:.1e}',
        'ms',
        'each solver at its cheapest setting within the error, against DOP853 at 1e-13',
        measure(contenders, repeats, scale=1e3),
        skipped,
    )


def _ours(problem: Problem, integrator: Integrator) -> Callable[[float], Array]:
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
