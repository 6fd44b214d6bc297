# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The arguments of all methods' loops, aligned in memory for vector loads."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ..potential import Array

VECTOR = 8
"""Numbers in the widest vector, which is also a cache line: 64 bytes."""

Chained = tuple[Array, ...]
"""The arrays of one chain: displacement, velocity, acceleration, and a method's work space.

Arrays of displacements, shape (n + 2,), carry a ghost cell at either end that repeats its
neighbour, so a free end needs no branch. All others have shape (n,).
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
        eta: Damping.
    """

    law: tuple[Any, ...]
    spring: tuple[Any, ...]
    origin: Array
    mobility: Array
    substrate: Array
    stuck: npt.NDArray[np.int64]
    eta: float


class Forcing(NamedTuple):
    """The prescribed motion of a run, at every node of every step, and the range of cells.

    Attributes:
        V_N: Displacement of the substrate's end, shape (m,).
        shake: Acceleration of the base, in whose frame the chains are, shape (m,).
        site: Index of the driven cell's displacement.
        driven: Number of leading nodes at which it is driven.
        motion: Its displacement and velocity, shape (2, >= driven).
        every: Number of steps between checks of all cells.
        low, high: The range of a cell's D; by default there is none.
        slow: The loop ends at a check at which all cells are slower; by default never.
        start: Displacement of the substrate's end before the run.
    """

    V_N: Array
    shake: Array
    site: int
    driven: int
    motion: Array
    every: int = 1
    low: float = -math.inf
    high: float = math.inf
    slow: float = 0.0
    start: float = 0.0


def aligned(values: Array, first: int = 0) -> Array:
    """Return a copy, shape (n,) or (rows, n), whose element `first` of every row begins a cache
    line, so that no vector spans two.

    Rows are padded so that each one does.

    Returns:
        Shape (n,), or (rows, m) with the first n columns filled, m >= n.
    """
    columns = values.shape[-1]
    if values.ndim > 1:
        columns += -columns % VECTOR
    shape = (*values.shape[:-1], columns)
    size = math.prod(shape)
    buffer = np.zeros(size + VECTOR)
    start = (-first - buffer.ctypes.data // buffer.itemsize) % VECTOR
    copy = buffer[start : start + size].reshape(shape)
    copy[..., : values.shape[-1]] = values
    return copy


def displacements(n: int) -> Array:
    """Return n displacements of zero with their ghost cells."""
    return aligned(np.zeros(n + 2), 1)


def per_cell(n: int) -> Array:
    """Return a zero for each of n cells."""
    return aligned(np.zeros(n))
