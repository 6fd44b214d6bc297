# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The kernel: nanoseconds per site and sub-step, on the same steps.

The C program is compiled by gcc -O3 -march=native -ffast-math with the vector sine of libmvec,
once with gcc's default vector width and once with the widest. It may contract and reorder; ours
may not.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from mlmem_ros.physics import CASE_II, PEFRL

from .c_program import WIDEST, NoCompiler, c_runner
from .comparison import Comparison
from .measure import Contender, measure
from .problem import COEFFICIENTS, STEP, Problem, Runner

TITLE = 'ns per site and sub-step compared with C and NumPy'

SITES = 450_000
"""Site steps per call: enough to make call overhead negligible."""


def run(repeats: int) -> list[Comparison]:
    """Measure the kernels at N = 225."""
    problem = Problem.of_size(CASE_II.N)
    steps = SITES // CASE_II.N
    fourth, skipped = problem.chain(integrator=PEFRL), {}
    ours, elastic = problem.chain(dt=STEP), problem.chain('elastic')
    work = 2.0 * steps * CASE_II.N
    contenders = [
        Contender('ours, rigid', partial(ours.rest, steps), work),
        Contender('ours, elastic', partial(elastic.rest, steps), work),
        Contender('ours, PEFRL, rigid', partial(fourth.rest, steps // 2), work),
    ]
    for name, flags in (('C', ()), ('C, widest vectors', (WIDEST,))):
        try:
            runner = c_runner(problem, *flags)
        except NoCompiler as error:
            skipped[name] = str(error)
        else:
            contenders.append(Contender(name, partial(runner.advance, steps), work))
    naive = numpy_runner(problem)
    contenders.append(Contender('NumPy', partial(naive.advance, steps // 20), work / 20.0))
    return [
        Comparison(
            'kernel',
            f'Kernel at N = {CASE_II.N}',
            'ns / site and sub-step',
            f'the same Noh-Bathe steps (step {STEP:g}) from the same state, one core; the elastic '
            'one moves two chains and counts a site once; a step of PEFRL has four sub-steps',
            measure(contenders, repeats, scale=1e9),
            skipped,
        )
    ]


def numpy_runner(problem: Problem) -> Runner:
    """Return the same steps as whole-array expressions."""
    eta = problem.design.eta
    a0, a1, a2, a3, a4, a5, a6, a7 = COEFFICIENTS
    u, v, A = problem.start, np.zeros(problem.design.N), problem.force(problem.start)

    def advance(steps: int) -> None:
        nonlocal u, v, A
        for _ in range(steps):
            u_p = u + a0 * v + a1 * A
            A_p = problem.force(u_p) - eta * (v + a0 * A)
            v_p = v + a2 * (A + A_p)
            u = u_p + a3 * v_p + a4 * A_p
            A_new = problem.force(u) - eta * (v_p + a3 * A_p)
            v = v_p + a5 * A + a6 * A_p + a7 * A_new
            A = A_new

    return Runner(advance, lambda: u)
