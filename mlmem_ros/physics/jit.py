# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The one home of the compiler settings.

No fast-math flag is given anywhere: without them LLVM neither contracts a multiply and an add
into one rounding nor reorders a sum, so that a kernel made of additions, multiplications and
roundings gives the same bits on every x86-64 host, and a NaN stays a NaN.

One setting of LLVM is changed, which touches no bit. A loop may only be vectorised where its
arrays do not overlap, and our loops have up to eighteen of them, more pairs than LLVM checks by
default: with the LLVM of numba 0.58 to 0.60 (Ubuntu 24.04 has it) they would run cell by cell,
ten times slower.
"""

from __future__ import annotations

import contextlib
import inspect
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar, cast

import llvmlite.binding
import numba

Function = TypeVar('Function', bound=Callable[..., Any])

llvmlite.binding.set_option('mlmem_ros', '--runtime-memory-check-threshold=128')

SETTINGS: dict[str, Any] = {'nogil': True, 'error_model': 'numpy'}
"""How a loop is compiled."""


def kernel(function: Function) -> Function:
    """Compile a loop; it releases the GIL and is cached on disk where a place can be written.

    Args:
        function: A function of scalars and arrays. What it calls is in the same file, or it is
            `built_on` another.

    Returns:
        The compiled function.
    """
    try:
        compiled = numba.njit(cache=True, **SETTINGS)(function)
    except RuntimeError:  # neither the package nor a home folder is writable: compile each time
        compiled = numba.njit(**SETTINGS)(function)
    return cast(Function, compiled)


def in_cache(compiled: Callable[..., Any]) -> bool:
    """Return whether a loop is compiled already, here or in the cache on disk.

    The cache is looked at from outside (numba's index of the loop, no older than its source), as
    it is for those who want to know how long the first call will take: after a change of the
    processor or of numba alone it may say yes, and the loop is compiled all the same.

    Args:
        compiled: What `kernel` returned.
    """
    dispatcher: Any = compiled
    if dispatcher.signatures:
        return True
    age = Path(inspect.getfile(dispatcher.py_func)).stat().st_mtime
    return any(index.stat().st_mtime >= age for index in _kept(compiled))


def inlined(function: Function) -> Function:
    """Write a function into each of its callers before they are compiled.

    Args:
        function: A scalar formula, or a loop that takes its caller's arrays.

    Returns:
        The compiled function.
    """
    return cast(Function, numba.njit(inline='always', error_model='numpy')(function))


def built_on(source: ModuleType) -> Callable[[Function], Function]:
    """Return a decorator for a compiled loop that has functions of another file inlined.

    numba looks at the age of the loop's own file only; what its cache keeps from before the other
    file was changed is thrown away here.

    Args:
        source: The other file.
    """

    def checked(compiled: Function) -> Function:
        with contextlib.suppress(OSError):  # no such file, or not ours to remove
            age = Path(str(source.__file__)).stat().st_mtime
            for index in _kept(compiled):
                if index.stat().st_mtime < age:
                    index.unlink()
        return compiled

    return checked


def _kept(compiled: Callable[..., Any]) -> list[Path]:
    """Return numba's index of a loop in its cache on disk; empty where there is none."""
    dispatcher: Any = compiled
    if (folder := dispatcher.stats.cache_path) is None:
        return []
    loop = dispatcher.py_func
    name = f'{Path(inspect.getfile(loop)).stem}.{loop.__qualname__}'
    return list(Path(folder).glob(f'{name}-{loop.__code__.co_firstlineno}.*.nbi'))
