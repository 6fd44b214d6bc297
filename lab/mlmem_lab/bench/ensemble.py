# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ensembles: the cost of an element among many, one after another and in threads."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial

from mlmem_ros.physics import CASE_II, Chain
from mlmem_ros.physics.potential import Array

from .comparison import Comparison
from .measure import Contender, measure
from .problem import STEP, Problem

TITLE = 'cost of an element among many, one after another and in threads'

SIZES = (1, 4, 16, 64, 256)

STEPS = 400
"""Steps of a call, five default ticks."""


def run(repeats: int) -> list[Comparison]:
    """Measure over the number of elements."""
    problem = Problem.of_size(CASE_II.N)
    cores = os.cpu_count()
    contenders = []
    with ThreadPoolExecutor(cores) as pool:
        for size in SIZES:
            work = 2.0 * STEPS * CASE_II.N * size
            for name, mapped in (('one after another', map), ('a thread per core', pool.map)):
                chains = [problem.chain(dt=STEP) for _ in range(size)]
                contenders.append(Contender(name, partial(_rest, mapped, chains), work, size))
        points = measure(contenders, repeats, scale=1e9)
    return [
        Comparison(
            'ensemble',
            f'Ensembles of chains, N = {CASE_II.N}, {STEPS} steps a call',
            'ns / site and sub-step',
            f'wall-clock time over all the work; {cores} cores',
            points,
            axis='elements',
        )
    ]


def _rest(mapped: Callable[..., Iterable[Array]], chains: Sequence[Chain]) -> None:
    list(mapped(lambda chain: chain.rest(STEPS), chains))
