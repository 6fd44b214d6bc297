# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The arrays of one chain, placed in memory as vectors are loaded."""

from __future__ import annotations

import numpy as np

from .potential import Array

VECTOR = 8
"""Numbers in the widest vector, which is also a cache line: 64 bytes."""


def aligned(values: Array, first: int = 0) -> Array:
    """Return a copy whose element `first` begins a cache line, so that no vector spans two."""
    buffer = np.empty(len(values) + VECTOR)
    start = (-first - buffer.ctypes.data // buffer.itemsize) % VECTOR
    copy = buffer[start : start + len(values)]
    copy[:] = values
    return copy


class Field:
    """Displacement (with ghost cells), velocity and acceleration of one chain, and work space.

    Attributes:
        u: Displacements, shape (N + 2,).
        velocity: Velocities, shape (N,).
        acceleration: Accelerations, shape (N,); zeros where the integrator keeps none.
        arrays: The first arguments of the integrator's loops.
    """

    def __init__(self, n: int, work: tuple[Array, ...]) -> None:
        """Make a chain's arrays.

        Args:
            n: Number of cells.
            work: The work space of the integrator.
        """
        self.u = aligned(np.zeros(n + 2), 1)
        self.velocity, self.acceleration = aligned(np.zeros(n)), aligned(np.zeros(n))
        self.arrays = (self.u, self.velocity, self.acceleration, *work)

    def rows(self) -> list[Array]:
        """Return the state without ghost cells."""
        return [self.u[1:-1], self.velocity, self.acceleration]

    def set(self, rows: Array) -> None:
        """Set the state; the kernel renews the ghost cells."""
        self.u[1:-1], self.velocity[:], self.acceleration[:] = rows
