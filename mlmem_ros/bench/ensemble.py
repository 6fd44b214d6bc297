# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ensembles: the cost of an element among many, on one core and on all."""

from __future__ import annotations

import os
from collections.abc import Sequence
from functools import partial

from ..physics import CASE_II, Chain
from ..physics.ensemble import Ensemble
from .comparison import Comparison
from .measure import Contender, measure
from .problem import STEP, Problem

TITLE = 'cost of an element among many, on one core and on all'

SIZES = (1, 4, 16, 64, 256)

STEPS = 400
"""Steps of a call, five default ticks."""


def run(repeats: int) -> list[Comparison]:
    """Measure over the number of elements."""
    problem = Problem.of_size(CASE_II.N)
    contenders = []
    for size in SIZES:
        work = 2.0 * STEPS * CASE_II.N * size
        chains = [problem.chain(dt=STEP) for _ in range(size)]
        one_by_one = partial(_one_by_one, chains)
        contenders.append(Contender('chains, one by one', one_by_one, work, size))
        for name, workers in (('ensemble, one core', 1), ('ensemble, all cores', None)):
            ensemble = Ensemble((problem.chain(dt=STEP) for _ in range(size)), workers)
            contenders.append(Contender(name, partial(ensemble.rest, STEPS), work, size))
    return [
        Comparison(
            'ensemble',
            f'Ensembles of chains, N = {CASE_II.N}, {STEPS} steps a call',
            'ns / site and sub-step',
            f'wall-clock time over all the work; {os.cpu_count()} cores',
            measure(contenders, repeats, scale=1e9),
            axis='elements',
        )
    ]


def _one_by_one(chains: Sequence[Chain]) -> None:
    for chain in chains:
        chain.rest(STEPS)
