# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The one home of the compiler settings.

No fast-math flag is given anywhere: without them LLVM neither contracts a multiply and an add
into one rounding nor reorders a sum, so that a kernel made of additions, multiplications and
roundings gives the same bits on every host, and a NaN stays a NaN. Where one rounding pays, the
source says so (`fma`): it is an IEEE 754 operation too, available on x86-64 since Haswell and on
every ARM64.

Three LLVM settings are changed, none of which affects a bit. Loops with `fma` get the widest
vectors available: on many AVX-512 processors LLVM uses only half the width. LLVM vectorises a loop
only if its arrays do not overlap; ours have up to eighteen, more pairs than it checks by default:
with the LLVM of numba 0.58 to 0.60 (Ubuntu 24.04 has it) they would run cell by cell, ten times
slower. And loops take four vectors at a time: a cell's sine is one long chain of operations, in
which each waits for the one before, and a processor looks ahead no further than the next few
vectors. The last two hold for all that numba compiles in the process.
"""

from __future__ import annotations

import contextlib
import hashlib
import inspect
import logging
import tempfile
from collections.abc import Callable
from pathlib import Path
from types import FunctionType
from typing import Any, ClassVar, TypeVar, cast

import llvmlite.binding
import numba
from numba.core.caching import FunctionCache
from numba.core.dispatcher import Dispatcher
from numba.core.runtime.nrt import rtsys

logger = logging.getLogger(__name__)

Function = TypeVar('Function', bound=Callable[..., Any])

for _option in ('--runtime-memory-check-threshold=128', '--force-vector-interleave=4'):
    llvmlite.binding.set_option('mlmem_ros', _option)

DISABLED: bool = bool(cast(Any, numba.config).DISABLE_JIT)
"""Whether the compiler is off (NUMBA_DISABLE_JIT=1): loops run in Python, 10 000 times slower."""

ARITHMETIC_VERSION = 'fused 2'
"""Version of the loops' exact results: it changes whenever a bit does."""


def compile_kernel(function: Function) -> Function:
    """Compile a loop over scalars, arrays, and tuples of them; it releases the GIL and is cached
    on disk if a place is writable.

    Returns:
        The compiled function.
    """
    if DISABLED:
        return function
    compiled: Any = numba.njit(nogil=True, error_model='numpy')(function)
    # Where neither the package nor a home folder is writable, it is compiled each time.
    with contextlib.suppress(RuntimeError):
        compiled._cache = _Cache(cast(FunctionType, function))
    return cast(Function, compiled)


def inline_function(function: Function) -> Function:
    """Write a function, a scalar formula or a loop that takes its caller's arrays, into each of
    its callers before they are compiled.

    Returns:
        The compiled function.
    """
    return cast(Function, numba.njit(inline='always', error_model='numpy')(function))


def _type_fma(typing: Any, a: Any, b: Any, c: Any) -> Any:
    return numba.float64(numba.float64, numba.float64, numba.float64), _emit_fma


def _round_twice(a: float, b: float, c: float) -> float:
    return a * b + c


fma = cast(
    Callable[[float, float, float], float],
    _round_twice if DISABLED else numba.extending.intrinsic(_type_fma),
)
"""Return a b + c, rounded once.

A processor without the instruction calls the C library, which gives the same bits, slowly. Where
the compiler is off, the product is rounded too: the results agree to rounding errors alone.
"""


def _emit_fma(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """Emit the instruction, and give the loop around it the widest vectors.

    That is an attribute of this one function; other compiled code of the process is unaffected.
    """
    set.add(
        builder.function.attributes, '"prefer-vector-width"="512"'
    )  # llvmlite's own `add` rejects this attribute
    return builder.fma(*arguments)


def is_cached(compiled: Callable[..., Any], *arguments: object) -> bool:
    """Return whether a `compile_kernel` is already compiled for arguments, of which only the
    types count, here or in the disk cache.
    """
    if DISABLED:
        return True
    loop: Any = compiled
    types = tuple(loop.typeof_pyval(each) for each in arguments)
    return types in loop.overloads or (
        isinstance(loop._cache, _Cache) and loop._cache.has_entry(types, loop.targetctx.codegen())
    )


def check_cache_space(folder: Path) -> None:
    """Write and remove a file as large as a full cache; raise `OSError` if that fails."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=folder) as file:
        file.write(bytes(4 * 2**20))


class _Cache(FunctionCache):
    """numba's disk cache, which a torn file or a full disk does not stop, and whose keys also
    cover the functions inlined into a loop and NUMBA_OPT.

    numba itself checks only the loop's own file, and would keep using an outdated formula, or code
    that was not optimised. A power cut may leave it an empty index, and a new edition of this
    package one that names types which are gone: it would fail at every start.
    """

    full: ClassVar[set[str]] = set()  # folders that could not be written; each is reported once

    def __init__(self, function: FunctionType) -> None:
        super().__init__(function)  # type: ignore[no-untyped-call]
        texts = (path.read_bytes() for path in sorted({Path(__file__), *_find_sources(function)}))
        self._digest = hashlib.sha256(b''.join(texts)).hexdigest()

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return cached machine code, or None; a torn cache is discarded, so that the loop is
        compiled anew.

        numba's own method first loads all that a loop might call, 0.4 s and 27 MB of each process.
        Machine code needs its runtime alone, unless it calls BLAS or draws random numbers; what is
        to be compiled loads the rest itself.
        """
        try:
            rtsys.initialize(target_context)
            return self._load_overload(sig, target_context)  # type: ignore[no-untyped-call]
        except Exception as error:  # a torn pickle raises anything
            Path(self._cache_file._index_path).unlink(missing_ok=True)  # so that none is found
            name, why = self._py_func.__qualname__, f'{type(error).__name__} {error}'.strip()
            logger.warning('compiling %s anew: its cache cannot be loaded (%s)', name, why)
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Cache machine code; where that fails, warn once: the next start compiles it again."""
        try:
            super().save_overload(sig, data)  # type: ignore[no-untyped-call]
        except OSError as error:
            if self.cache_path not in self.full:
                self.full.add(self.cache_path)
                logger.warning(
                    'compiled kernels cannot be cached in %s (%s): every start takes some seconds '
                    'longer; free some space, or set NUMBA_CACHE_DIR',
                    self.cache_path, error.strerror,
                )  # fmt: skip

    def _index_key(self, sig: Any, codegen: Any) -> Any:
        key = super()._index_key(sig, codegen)  # type: ignore[no-untyped-call]
        return (*key, self._digest, int(cast(Any, numba.config).OPT))

    def has_entry(self, types: tuple[Any, ...], codegen: Any) -> bool:
        """Return whether machine code for these types is cached."""
        key = self._index_key(types, codegen)
        try:
            return self._cache_file.load(key) is not None  # type: ignore[no-untyped-call]
        except Exception:  # a torn pickle raises anything
            return False


def _find_sources(function: FunctionType) -> set[Path]:
    """Return the files of a function and of all compiled ones that it calls."""
    found = {Path(inspect.getfile(function))}
    for name in function.__code__.co_names:
        if isinstance(called := function.__globals__.get(name), Dispatcher):
            found |= _find_sources(called.py_func)
    return found
