# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The one home of the compiler settings.

No fast-math flag is given anywhere: without them LLVM neither contracts a multiply and an add
into one rounding nor reorders a sum, so that a kernel made of additions, multiplications and
roundings gives the same bits on every host, and a NaN stays a NaN. Where one rounding pays, the
source says so (`fma`): that is one operation of IEEE 754 as well, which x86-64 has since Haswell
and ARM64 has always had.

Two settings of LLVM are changed, which touch no bit. Loops that say `fma` get the widest vectors
there are: for many a processor with AVX-512 LLVM uses half of it. And a loop may only be
vectorised where its arrays do not overlap, and our loops have up to eighteen of them, more pairs
than LLVM checks by default: with the LLVM of numba 0.58 to 0.60 (Ubuntu 24.04 has it) they would
run cell by cell, ten times slower.
"""

from __future__ import annotations

import contextlib
import hashlib
import inspect
import platform
from collections.abc import Callable
from pathlib import Path
from types import FunctionType
from typing import Any, TypeVar, cast

import llvmlite.binding
import numba
from numba.core.caching import FunctionCache
from numba.core.dispatcher import Dispatcher

Function = TypeVar('Function', bound=Callable[..., Any])

llvmlite.binding.set_option('mlmem_ros', '--runtime-memory-check-threshold=128')

ARITHMETIC = 'fused 1'
"""Name of what the loops compute to the bit: a change that changes bits changes the name."""

SETTINGS: dict[str, Any] = {'nogil': True, 'error_model': 'numpy'}
"""How a loop is compiled."""

WIDEST = '"prefer-vector-width"="512"'
"""Attribute of a function: for many processors with AVX-512 LLVM chooses half of its width."""


def kernel(function: Function) -> Function:
    """Compile a loop; it releases the GIL and is cached on disk where a place can be written.

    Args:
        function: A function of scalars, arrays, and tuples of them.

    Returns:
        The compiled function.
    """
    compiled: Any = numba.njit(**SETTINGS)(function)
    # Where neither the package nor a home folder is writable, it is compiled each time.
    with contextlib.suppress(RuntimeError):
        compiled._cache = _Cache(cast(FunctionType, function))
    return cast(Function, compiled)


def inlined(function: Function) -> Function:
    """Write a function into each of its callers before they are compiled.

    Args:
        function: A scalar formula, or a loop that takes its caller's arrays.

    Returns:
        The compiled function.
    """
    return cast(Function, numba.njit(inline='always', error_model='numpy')(function))


def _typed(typing: Any, a: Any, b: Any, c: Any) -> Any:
    return numba.float64(numba.float64, numba.float64, numba.float64), _write


fma = cast(Callable[[float, float, float], float], numba.extending.intrinsic(_typed))
"""Return a b + c, rounded once; in compiled code only.

A processor without the instruction calls the C library, which gives the same bits, slowly.
"""


def _write(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """Write the instruction, and let the loop that it is written into have the widest vectors.

    It is an attribute of this one function: other compiled code of the process is left as it is.
    """
    set.add(builder.function.attributes, WIDEST)  # llvmlite's own `add` knows no such attribute
    return builder.fma(*arguments)


def fused() -> bool:
    """Return whether the processor has the instruction that `fma` stands for.

    NUMBA_CPU_FEATURES counts, where it is set, as it does for the compiler.
    """
    features: str | None = cast(Any, numba.config).CPU_FEATURES
    if features is None:
        features = llvmlite.binding.get_host_cpu_features().flatten()
    return platform.machine() not in ('x86_64', 'AMD64') or '+fma' in features.split(',')


def in_cache(compiled: Callable[..., Any], *arguments: object) -> bool:
    """Return whether a loop is compiled already for arguments, here or in the cache on disk.

    Args:
        compiled: What `kernel` returned.
        *arguments: As it would be called with; only their types count.
    """
    loop: Any = compiled
    types = tuple(loop.typeof_pyval(each) for each in arguments)
    return types in loop.overloads or (
        isinstance(loop._cache, _Cache) and loop._cache.holds(types, loop.targetctx.codegen())
    )


def cache_folder(compiled: Callable[..., Any]) -> Path | None:
    """Return where a loop's machine code is kept; None where it cannot be."""
    path = cast(Any, compiled).stats.cache_path
    return None if path is None else Path(path)


class _Cache(FunctionCache):
    """numba's cache on disk, whose keys also tell what was written into a loop.

    numba itself looks at the loop's own file alone, and would go on with a formula of before.
    """

    def __init__(self, function: FunctionType) -> None:
        super().__init__(function)  # type: ignore[no-untyped-call]
        texts = (path.read_bytes() for path in sorted({Path(__file__), *_sources(function)}))
        self._digest = hashlib.sha256(b''.join(texts)).hexdigest()

    def _index_key(self, sig: Any, codegen: Any) -> Any:
        key = super()._index_key(sig, codegen)  # type: ignore[no-untyped-call]
        return (*key, self._digest)

    def holds(self, types: tuple[Any, ...], codegen: Any) -> bool:
        """Return whether machine code for these types is kept."""
        kept = self._cache_file._load_index()  # type: ignore[no-untyped-call]
        return self._index_key(types, codegen) in kept


def _sources(function: FunctionType) -> set[Path]:
    """Return the files of a function and of all compiled ones that it calls."""
    found = {Path(inspect.getfile(function))}
    for name in function.__code__.co_names:
        if isinstance(called := function.__globals__.get(name), Dispatcher):
            found |= _sources(called.py_func)
    return found
