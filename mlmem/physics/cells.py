# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An element's cells as the compiled loop takes them; and when they rest: nothing moves but the
last bits of their numbers.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from .formulas import coupling_pull, on_site_factors
from .jit import compile_kernel, fma, inline_function
from .values import Array

Chained = tuple[Array, Array, Array]
"""The arrays of one chain: displacements, shape (n + 2,), velocities, shape (n,), and the loop's
two rows of displacements, shape (2, n + 2).

Displacements carry a ghost cell at either end that repeats its neighbour, so a free end needs no
branch.
"""


class Cells(NamedTuple):
    """The properties of an element's cells.

    Attributes:
        law: Constants of the on-site law.
        spring: Constants of the coupling.
        origin: Displacement over the substrate from which the on-site formula counts, shape (n,).
        mobility: Inverse of a cell's mass, shape (n,).
        substrate: Of a rigid substrate its displacement per unit V_N, shape (n,); of an elastic
            one the stiffness left of every cell and right of the last, shape (n + 1,).
        stuck: Indices of the cells that stick to the substrate under them, whole numbers. Over a
            rigid one their velocities read zero.
    """

    law: tuple[Any, ...]
    spring: tuple[Any, ...]
    origin: Array
    mobility: Array
    substrate: Array
    stuck: npt.NDArray[np.int64]


class Forcing(NamedTuple):
    """The prescribed motion of a run, at every node of every step, and the range of cells.

    Attributes:
        V_N: Displacement of the substrate's end, shape (m,).
        shake: Acceleration of the base, in whose frame the chains are, shape (m,).
        site: Index of the driven cell's displacement.
        driven: Number of leading nodes at which it is driven.
        motion: Its displacement and velocity, shape (2, >= driven).
        every: Number of steps between checks of all cells.
        low, high: The range of a cell's D.
        slow: The loop ends at a check at which all cells are slower; never if it is 0.
        start: Displacement of the substrate's end before the run.
    """

    V_N: Array
    shake: Array
    site: int
    driven: int
    motion: Array
    every: int
    low: float
    high: float
    slow: float
    start: float


def align_array(values: Array, first: int = 0) -> Array:
    """Return a copy, shape (n,) or (rows, n), whose element `first` of every row begins a cache
    line, so that no vector spans two.

    Rows are padded so that each one does.

    Returns:
        Shape (n,), or (rows, m) with the first n columns filled, m >= n.
    """
    vector_size = 8  # numbers in the widest vector, which is also a cache line: 64 bytes
    columns = values.shape[-1]
    if values.ndim > 1:
        columns += -columns % vector_size
    shape = (*values.shape[:-1], columns)
    size = math.prod(shape)
    buffer = np.zeros(size + vector_size)
    start = (-first - buffer.ctypes.data // buffer.itemsize) % vector_size
    copy = buffer[start : start + size].reshape(shape)
    copy[..., : values.shape[-1]] = values
    return copy


def make_chain_arrays(n: int) -> Chained:
    """Return the arrays of a chain of n cells, all zero."""
    return (
        align_array(np.zeros(n + 2), 1),
        align_array(np.zeros(n)),
        align_array(np.zeros((2, n + 2)), 1),
    )


MAX_REST_SPEED = 1e-13
"""Speed and acceleration below which a cell rests.

Rounding makes a chain tremble at 1e-15 for ever. To stop a wave of this size changes an echo's v_c
by less than 2e-14, a fifth of the least threshold, and no delay; nor did one of 1e-6. An elastic
substrate under strain is so stiff that it trembles more, and never rests.
"""


@inline_function
def is_below_speed(v: Array, limit: float) -> bool:
    """Return whether all cells are slower than a limit; at a limit of 0 none is."""
    for each in v:  # noqa: SIM110 (compiled code has no generators)
        if not abs(each) < limit:
            return False
    return True


@compile_kernel
def is_balanced(u: Array, U: Array | None, cells: Cells, V_N: float) -> bool:
    """Return whether the forces of a chain without motion leave it at rest.

    Args:
        u: Displacements with their ghost cells, which are renewed.
        U: The same of an elastic substrate, or None.
        V_N: Displacement of the substrate's end.

    Returns:
        Whether no cell has an acceleration of `MAX_REST_SPEED` or more.
    """
    law, spring, origin, mobility, under, stuck = cells
    n = len(u) - 2
    if U is not None and len(stuck) > 0:
        return False  # nor does a strained elastic substrate ever rest
    u[0] = u[1]
    u[n + 1] = u[n]
    for j in range(n):
        x = u[j + 1]
        y = x - (fma(V_N, under[j], origin[j]) if U is None else U[j + 1] + origin[j])
        slope, sine = on_site_factors(law, j, y)
        pull = fma(-slope, sine, coupling_pull(spring, j, u[j], x, u[j + 2]))
        if not abs(mobility[j] * pull) < MAX_REST_SPEED:
            return False
        if U is not None and 0 < j < n - 1:
            tension = under[j + 1] * (U[j + 2] - U[j + 1])
            pull = fma(-under[j], U[j + 1] - U[j], tension)
            if not abs(fma(slope, sine, pull)) < MAX_REST_SPEED:
                return False
    return True
