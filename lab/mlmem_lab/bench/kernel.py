# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The kernel: nanoseconds per site and sub-step, on the same steps, of a wall at rest and a wave
packet that runs into it.

The C program is compiled by gcc -O3 -march=native -ffast-math with the vector sine of libmvec,
once with gcc's default vector width and once with the widest. It may contract and reorder; ours
may not.
"""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from importlib import resources
from pathlib import Path
from typing import NamedTuple

import numpy as np

from mlmem.physics import CASE_II, NOH_BATHE, PEFRL, Chain, Design, Integrator
from mlmem.physics.equilibrium import wall_profile
from mlmem.physics.methods.noh_bathe import compute_coefficients
from mlmem.physics.potential import Array

from .measure import Comparison, Contender, measure_contenders

TIME_STEP = 0.25
"""The step of the comparisons: the device's default."""

NOH_BATHE_COEFFICIENTS = np.array(compute_coefficients(TIME_STEP))
"""a0 ... a7 of Noh and Bathe's method."""


class Runner(NamedTuple):
    """An implementation with its own state."""

    advance: Callable[[int], None]
    displacements: Callable[[], Array]


@dataclass(frozen=True)
class Problem:
    """Eq. (1a) over an unstrained rigid substrate, both ends free.

    Attributes:
        start: Displacements at the start, at rest, shape (N,).
    """

    design: Design
    start: Array

    @classmethod
    def with_cells(cls, n: int) -> Problem:
        """Return the problem on n cells: Case II, for other sizes without its gradient."""
        design = CASE_II if n == CASE_II.N else replace(CASE_II, N=n, gamma=0.0)
        x = design.sites
        packet = 0.01 * np.exp(-(((x - 0.2 * n) / 8.0) ** 2)) * np.sin(1.2 * x)
        return cls(design, wall_profile(design, 0.45 * n) + packet)

    def force(self, x: Array) -> Array:
        """Return the forces at displacements x, shape (N,), without damping, in plain NumPy."""
        p, z = self.design, x + self.design.c
        square = z * z
        force = -self.height * np.sin(z * (p.a + p.b * square)) * (p.a + 3.0 * p.b * square)
        stretch = np.diff(x)
        force[:-1] += stretch
        force[1:] -= stretch
        return np.asarray(force)

    @cached_property
    def height(self) -> Array:
        """alpha_j d, shape (N,)."""
        return self.design.alpha * self.design.d

    def chain(
        self,
        substrate: str = 'rigid',
        dt: float | None = None,
        integrator: Integrator = NOH_BATHE,
    ) -> Chain:
        """Return our own chain in the initial state."""
        chain = Chain(replace(self.design, substrate=substrate), dt, integrator)
        chain.place(self.start)
        return chain


TITLE = 'ns per site and sub-step compared with C and NumPy'


def run(repeats: int) -> list[Comparison]:
    """Measure the kernels at N = 225."""
    problem = Problem.with_cells(CASE_II.N)
    site_steps_per_call = 450_000  # site steps per call: enough to make call overhead negligible
    steps = site_steps_per_call // CASE_II.N
    fourth, skipped = problem.chain(integrator=PEFRL), {}
    ours, elastic = problem.chain(dt=TIME_STEP), problem.chain('elastic')
    work = 2.0 * steps * CASE_II.N
    contenders = [
        Contender('ours, rigid', partial(ours.rest, steps), work),
        Contender('ours, elastic', partial(elastic.rest, steps), work),
        Contender('ours, PEFRL, rigid', partial(fourth.rest, steps // 2), work),
    ]
    wide_vector_flag = '-mprefer-vector-width=512'
    for name, flags in (('C', ()), ('C, widest vectors', (wide_vector_flag,))):
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
            f'the same Noh-Bathe steps (step {TIME_STEP:g}) from the same state, one core; the '
            f'elastic '
            'one moves two chains and counts a site once; a step of PEFRL has four sub-steps',
            measure_contenders(contenders, repeats, scale=1e9),
            skipped,
        )
    ]


def numpy_runner(problem: Problem) -> Runner:
    """Return the same steps as whole-array expressions."""
    eta = problem.design.eta
    a0, a1, a2, a3, a4, a5, a6, a7 = NOH_BATHE_COEFFICIENTS
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


class NoCompiler(Exception):
    """There is no C compiler, or it fails; the message says why."""


def compile_library(*more_flags: str) -> ctypes.CDLL:
    """Compile and load the program.

    Raises:
        NoCompiler: There is no gcc, or it fails.
    """
    gcc = shutil.which('gcc')
    if gcc is None:
        raise NoCompiler('gcc is missing')
    source = resources.files(__package__).joinpath('rigid.c').read_text(encoding='utf-8')
    compiler_flags = ('-O3', '-march=native', '-ffast-math', '-fPIC')
    linked_libraries = ('-lmvec', '-lm')
    with tempfile.TemporaryDirectory() as folder:
        unit, library = Path(folder) / 'rigid.o', Path(folder) / 'rigid.so'
        # Linked with -ffast-math, older gcc add start-up code that turns denormal numbers off
        # in the whole process, ours and its bits included.
        for command in (
            [gcc, *compiler_flags, *more_flags, '-x', 'c', '-c', '-', '-o', str(unit)],
            [gcc, '-shared', str(unit), '-o', str(library), *linked_libraries],
        ):
            done = subprocess.run(command, input=source, capture_output=True, text=True)
            if done.returncode:
                raise NoCompiler(done.stderr.strip().splitlines()[-1])
        return ctypes.CDLL(str(library))


def c_runner(problem: Problem, *more_flags: str) -> Runner:
    """Return the C program on a problem.

    Raises:
        NoCompiler: There is no gcc, or it fails.
    """
    function = compile_library(*more_flags).advance_rigid
    vector = np.ctypeslib.ndpointer(np.float64, flags='C')
    function.argtypes = [ctypes.c_long] * 2 + [vector] * 9 + [ctypes.c_double] * 4 + [vector]
    function.restype = None
    design, n = problem.design, problem.design.N
    u = np.pad(problem.start, 1)  # u and u_p have a ghost cell at either end
    state = u, np.zeros(n), problem.force(problem.start), np.zeros(n + 2), np.zeros(n), np.zeros(n)
    shape = np.array(design.strain_shape)

    def advance(steps: int) -> None:
        function(
            steps, n, *state, problem.height, shape, np.zeros(2 * steps),
            design.eta, design.a, design.b, design.c, NOH_BATHE_COEFFICIENTS,
        )  # fmt: skip

    return Runner(advance, lambda: u[1:-1])
