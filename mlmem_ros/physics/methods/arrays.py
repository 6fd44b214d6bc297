# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the loops of all methods take, placed in memory as vectors are loaded."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ..potential import Array

VECTOR = 8
"""Numbers in the widest vector, which is also a cache line: 64 bytes."""

Chained = tuple[Array, ...]
"""The arrays of one chain: displacement, velocity, acceleration, and a method's work space.

Arrays of displacements, shape (n + 2,), carry a ghost cell at either end which repeats its
neighbour: a free end needs no branch. All others have shape (n,).
"""


class Cells(NamedTuple):
    """What the cells of an element are.

    Attributes:
        height: alpha_j d, shape (n,).
        origin: Displacement over the substrate at which the phase is none, shape (n,): the shift
            of a cell's ground states less c.
        mobility: Inverse of a cell's mass, shape (n,).
        substrate: Of a rigid substrate its displacement per unit V_N, shape (n,); of an elastic
            one the stiffness left of every cell and right of the last, shape (n + 1,).
        stuck: Indices of the cells that do not move relative to the base, whole numbers.
        eta: Damping.
        a, b: Potential.
    """

    height: Array
    origin: Array
    mobility: Array
    substrate: Array
    stuck: npt.NDArray[np.int64]
    eta: float
    a: float
    b: float


class Course(NamedTuple):
    """What is prescribed in a run, at every node of every step; and how far cells may get.

    Attributes:
        V_N: Displacement of the substrate's end, shape (m,).
        shake: Acceleration of the base, in whose frame the chains are, shape (m,).
        site: The driven cell, as index of its displacement.
        driven: Number of leading nodes at which it is driven.
        motion: Its displacement and velocity, shape (2, >= driven).
        every: Steps after each of which all cells shall be in range.
        low, high: The range of a cell's D; by default there is none.
    """

    V_N: Array
    shake: Array
    site: int
    driven: int
    motion: Array
    every: int = 1
    low: float = -math.inf
    high: float = math.inf


def aligned(values: Array, first: int = 0) -> Array:
    """Return a copy whose element `first` begins a cache line, so that no vector spans two.

    Rows are filled up for each of them to begin so.

    Args:
        values: Shape (n,) or (rows, n).
        first: Index in a row.

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
