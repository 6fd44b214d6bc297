# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The one home of the compiler settings.

No fast-math flag is given anywhere: without them LLVM neither contracts a multiply and an add
into one rounding nor reorders a sum, so that a kernel made of additions, multiplications and
roundings gives the same bits on every x86-64 host, and a NaN stays a NaN.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

Function = TypeVar('Function', bound=Callable[..., Any])


def kernel(function: Function) -> Function:
    """Compile a loop; it releases the GIL and is cached on disk where a place can be written.

    Args:
        function: A function of scalars and arrays, with all it calls in the same file (numba
            looks at one file's age only when it decides whether its cache is stale).

    Returns:
        The compiled function.
    """
    try:
        compiled = numba.njit(cache=True, nogil=True, error_model='numpy')(function)
    except RuntimeError:  # neither the package nor a home folder is writable: compile each time
        compiled = numba.njit(nogil=True, error_model='numpy')(function)
    return cast(Function, compiled)


def inlined(function: Function) -> Function:
    """Compile a scalar formula into the loops that call it.

    Args:
        function: A function of scalars.

    Returns:
        The compiled function.
    """
    return cast(Function, numba.njit(inline='always', error_model='numpy')(function))
