# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The hand-written C program `rigid.c`, compiled on the spot."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
from importlib import resources
from pathlib import Path

import numpy as np

from .problem import COEFFICIENTS, Problem, Runner

FLAGS = ('-O3', '-march=native', '-ffast-math', '-fPIC')
WIDEST = '-mprefer-vector-width=512'
LIBRARIES = ('-lmvec', '-lm')


class NoCompiler(Exception):
    """There is no C compiler, or it fails; the message says why."""


def compiled(*more_flags: str) -> ctypes.CDLL:
    """Compile and load the program.

    Raises:
        NoCompiler: There is no gcc, or it fails.
    """
    gcc = shutil.which('gcc')
    if gcc is None:
        raise NoCompiler('gcc is missing')
    source = resources.files(__package__).joinpath('rigid.c').read_text(encoding='utf-8')
    with tempfile.TemporaryDirectory() as folder:
        unit, library = Path(folder) / 'rigid.o', Path(folder) / 'rigid.so'
        # Linked with -ffast-math, older gcc add start-up code that turns denormal numbers off
        # in the whole process, ours and its bits included.
        for command in (
            [gcc, *FLAGS, *more_flags, '-x', 'c', '-c', '-', '-o', str(unit)],
            [gcc, '-shared', str(unit), '-o', str(library), *LIBRARIES],
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
    function = compiled(*more_flags).advance_rigid
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
            design.eta, design.a, design.b, design.c, COEFFICIENTS,
        )  # fmt: skip

    return Runner(advance, lambda: u[1:-1])
