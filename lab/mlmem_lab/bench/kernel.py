# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The kernel: nanoseconds per site and stage of a step, on the same steps, of a wall at rest and a
wave packet that runs into it.

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
from dataclasses import replace
from functools import partial
from importlib import resources
from pathlib import Path

import numpy as np

from mlmem.physics import CASE_II, Chain
from mlmem.physics.equilibrium import wall_profile
from mlmem.physics.pefrl import KICK_FRACTIONS, compute_constants
from mlmem.physics.values import Array

from .measure import Contender, ResultTable, compare_costs, measure_contenders

TIME_STEP = 0.5
"""The step of the comparisons."""


def build_chain(substrate: str = 'rigid', dt: float | None = TIME_STEP) -> Chain:
    """Return our own chain in the initial state: a wall, and a packet that runs into it."""
    x, n = CASE_II.sites, CASE_II.N
    packet = 0.01 * np.exp(-(((x - 0.2 * n) / 8.0) ** 2)) * np.sin(1.2 * x)
    chain = Chain(replace(CASE_II, substrate=substrate), dt)
    chain.place(wall_profile(CASE_II, 0.45 * n) + packet)
    return chain


def run(repeats: int) -> ResultTable:
    """Measure the kernels at N = 225."""
    steps = 450_000 // CASE_II.N  # enough to make the overhead of a call negligible
    work = float(len(KICK_FRACTIONS) * steps * CASE_II.N)
    elastic = build_chain('elastic', None)
    contenders = [
        Contender('ours, rigid', partial(build_chain().advance_steps, steps), work),
        Contender('ours, elastic', partial(elastic.advance_steps, steps), work),
    ]
    skipped = ''
    for name, flags in (('C', ()), ('C, widest vectors', ('-mprefer-vector-width=512',))):
        try:
            contenders.append(Contender(name, partial(start_c_program(*flags)[0], steps), work))
        except NoCompiler as error:
            skipped += f'; {name} skipped: {error}'
    costs = measure_contenders(contenders, repeats, scale=1e9)
    caption = (
        f'the same steps of {TIME_STEP:g} from the same state, one core; a step has four stages, '
        'in each of which all forces are computed; the elastic one moves two chains and counts a '
        'site once'
    )
    rows = compare_costs(contenders, costs, 'ns / site and stage')
    return ResultTable(f'Kernel at N = {CASE_II.N}', caption + skipped, rows)


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
    flags = ('-O3', '-march=native', '-ffast-math', '-fPIC')
    with tempfile.TemporaryDirectory() as folder:
        unit, library = Path(folder) / 'rigid.o', Path(folder) / 'rigid.so'
        # Linked with -ffast-math, older gcc add start-up code that turns denormal numbers off
        # in the whole process, ours and its bits included.
        for command in (
            [gcc, *flags, *more_flags, '-x', 'c', '-c', '-', '-o', str(unit)],
            [gcc, '-shared', str(unit), '-o', str(library), '-lmvec', '-lm'],
        ):
            done = subprocess.run(command, input=source, capture_output=True, text=True)
            if done.returncode:
                raise NoCompiler(done.stderr.strip().splitlines()[-1])
        return ctypes.CDLL(str(library))


def start_c_program(*more_flags: str) -> tuple[Callable[[int], None], Array]:
    """Return what advances the C program from the initial state by so many steps, and its
    displacements, shape (N,), which change meanwhile.

    Raises:
        NoCompiler: There is no gcc, or it fails.
    """
    function = compile_library(*more_flags).advance_rigid
    vector = np.ctypeslib.ndpointer(np.float64, flags='C')
    function.argtypes = [ctypes.c_long] * 2 + [vector] * 6 + [ctypes.c_double] * 3 + [vector] * 3
    function.restype = None
    design, n = CASE_II, CASE_II.N
    v, velocity = build_chain().state()
    u = np.pad(v, 1)  # displacements have a ghost cell at either end
    state = u, np.zeros(n + 2), velocity
    shape, height = np.array(design.strain_shape), design.alpha * design.d
    constants = compute_constants(TIME_STEP, np.ones(1), design.eta)
    decay, kick = (np.ascontiguousarray(each[:, 0]) for each in (constants.decay, constants.kick))

    def advance(steps: int) -> None:
        function(
            steps, n, *state, height, shape, np.zeros(len(KICK_FRACTIONS) * steps),
            design.a, design.b, design.c, constants.drifts, decay, kick,
        )  # fmt: skip

    return advance, u[1:-1]
