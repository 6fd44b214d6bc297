# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The kernel: nanoseconds per site and sub-step, on the same steps, and over the chain's length.

The C program is gcc -O3 -march=native -ffast-math with the vector sine of libmvec, once with gcc's
default vector width and once with the widest. It may contract and reorder; ours may not.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from ..physics import CASE_II, PEFRL
from .c_program import WIDEST, NoCompiler, c_runner
from .comparison import Comparison
from .measure import Contender, measure
from .plain import numba_runner, numpy_runner
from .problem import STEP, Problem

TITLE = 'ns per site and sub-step compared with C, numba and NumPy; scaling with the length'

LENGTHS = (100, 225, 1_000, 3_000, 10_000, 30_000, 100_000)

SITES = 450_000
"""Site steps per call: enough to make call overhead negligible."""


def run(repeats: int) -> list[Comparison]:
    """Measure the kernels at N = 225, and ours and C over N."""
    return [_at_the_papers_length(repeats), _over_the_length(repeats)]


def _at_the_papers_length(repeats: int) -> Comparison:
    problem = Problem.of_size(CASE_II.N)
    steps = SITES // CASE_II.N
    fourth, skipped = problem.chain(integrator=PEFRL), {}
    contenders = [
        _contender('ours, rigid', problem.chain(dt=STEP).rest, steps, CASE_II.N),
        _contender('ours, elastic', problem.chain('elastic').rest, steps, CASE_II.N),
        Contender('ours, PEFRL, rigid', partial(fourth.rest, steps // 2), 2.0 * steps * CASE_II.N),
    ]
    for name, flags in (('C', ()), ('C, widest vectors', (WIDEST,))):
        try:
            runner = c_runner(problem, *flags)
        except NoCompiler as error:
            skipped[name] = str(error)
        else:
            contenders.append(_contender(name, runner.advance, steps, CASE_II.N))
    contenders += [
        _contender('numba, math.sin', numba_runner(problem).advance, steps, CASE_II.N),
        _contender('NumPy', numpy_runner(problem).advance, steps // 20, CASE_II.N),
    ]
    return Comparison(
        'kernel',
        f'Kernel at N = {CASE_II.N}',
        'ns / site and sub-step',
        f'the same Noh-Bathe steps (step {STEP:g}) from the same state, one core; the elastic '
        'one moves two chains and counts a site once; a step of PEFRL has four sub-steps',
        measure(contenders, repeats, scale=1e9),
        skipped,
    )


def _over_the_length(repeats: int) -> Comparison:
    contenders, skipped = [], {}
    for n in LENGTHS:
        problem, steps = Problem.of_size(n), max(2, SITES // n)
        contenders += [
            _contender('ours, rigid', problem.chain(dt=STEP).rest, steps, n, n),
            _contender('ours, elastic', problem.chain('elastic').rest, steps, n, n),
        ]
        try:
            contenders.append(_contender('C', c_runner(problem).advance, steps, n, n))
        except NoCompiler as error:
            skipped['C'] = str(error)
    return Comparison(
        'kernel_scaling',
        'Kernel over the length of the chain',
        'ns / site and sub-step',
        'a flat line is a cost linear in N',
        measure(contenders, repeats, scale=1e9),
        skipped,
        axis='sites N',
    )


def _contender(
    name: str, advance: Callable[[int], object], steps: int, n: int, x: float | None = None
) -> Contender:
    return Contender(name, lambda: advance(steps), 2.0 * steps * n, x)
