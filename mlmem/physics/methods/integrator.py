# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a chain needs to know about a time-stepping method, the arguments of all loops, and when a
chain rests: nothing moves but the last bits of its numbers.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ..formulas import coupling_pull, on_site_factors
from ..jit import compile_kernel, fma, inline_function
from ..values import Array, Complex

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


def make_displacements(n: int) -> Array:
    """Return n displacements of zero with their ghost cells."""
    return align_array(np.zeros(n + 2), 1)


def make_cell_array(n: int) -> Array:
    """Return a zero for each of n cells."""
    return align_array(np.zeros(n))


class Integrator(ABC):
    """An explicit method of fixed step, made of sub-steps.

    Attributes:
        nodes: The times in a step at which it needs the prescribed motion (strain, base, driven
            cell), as fractions of the step: rising, the last one 1.
        accurate_step: Largest step with the rigid substrate.
        accurate_turn: Largest omega dt of the cells: they swing from barrier to barrier, and steps
            that are stable for small waves only were seen to heat them until they diverged.
        stable_turn: Largest omega dt considered stable without damping.
        keeps_accelerations: Whether a chain's state holds accelerations.
        damps_each: Whether every cell may have a damping of its own, over a rigid substrate.
        advance: The loop of both substrates; see `noh_bathe`.
    """

    name: str
    nodes: tuple[float, ...]
    accurate_step: float
    accurate_turn: float
    stable_turn: float
    keeps_accelerations: bool
    damps_each: bool = False
    advance: Callable[..., tuple[int, bool]]

    @abstractmethod
    def limit(self, omega: float, eta: float) -> float:
        """Return the largest step considered stable.

        Args:
            omega: Greatest angular frequency of undamped small waves.
            eta: Damping over the least mass.
        """

    @abstractmethod
    def make_arrays(self, n: int) -> Chained:
        """Return the arrays of a chain of n cells: u, du, ddu and the loop's work space."""

    @abstractmethod
    def constants(self, dt: float, mobility: Array, eta: Any) -> Any:
        """Return the constants of a step, as the loop takes them.

        Args:
            dt: Step size in time units.
            mobility: Inverse masses, shape (N,), 0 for a stuck cell.
            eta: Damping; of every cell, shape (N,), if it `damps_each`.
        """

    @abstractmethod
    def step_matrix(self, stiffness: Complex, eta: float, dt: float) -> Complex:
        """Return the matrix of a step of an oscillator of unit mass on its state.

        Args:
            stiffness: Shape (m,).
            eta: Damping.
            dt: Step size in time units.

        Returns:
            Shape (m, k, k), with k numbers in the state.
        """

    @property
    def substeps(self) -> int:
        """Number of times in a step at which the prescribed motion is needed."""
        return len(self.nodes)

    def squared_frequency(self, omega: Array | Complex, eta: float, dt: float) -> Complex:
        """Return the effective stiffness (unit mass) of this scheme for a wave of a frequency.

        A harmonic motion exp(i omega t) solves u'' + eta u' + w u = 0 for
        w = omega^2 - i eta omega. For the scheme's discrete motion w differs by its dispersion and
        numerical damping: it is the w for which exp(i omega dt) is an eigenvalue of the step,
        found by the secant method.

        Args:
            omega: Angular frequencies, shape (m,).
            eta: Damping.
            dt: Step size in time units; 0 gives the exact value.

        Returns:
            w, shape (m,).
        """
        exact = np.asarray(omega**2 - 1j * eta * omega, dtype=np.complex128)
        if dt == 0.0:
            return exact
        turn = np.exp(1j * omega * dt)
        before, w = exact, exact * (1.0 + 1e-4)
        miss_before, miss = (self._compute_residual(each, turn, eta, dt) for each in (before, w))
        for _ in range(12):
            change = miss - miss_before
            moving = np.abs(change) > 1e-300
            step = np.where(moving, miss * (w - before) / np.where(moving, change, 1.0), 0.0)
            before, w, miss_before = w, w - step, miss
            if np.abs(step).max(initial=0.0) < 1e-12:
                break
            miss = self._compute_residual(w, turn, eta, dt)
        return np.asarray(w)

    def _compute_residual(self, w: Complex, turn: Complex, eta: float, dt: float) -> Complex:
        """Return det(M(w) - turn), M the matrix of a step, shape (m,)."""
        matrix = self.step_matrix(w, eta, dt)
        return np.asarray(np.linalg.det(matrix - turn[:, None, None] * np.eye(matrix.shape[-1])))


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
    law, spring, origin, mobility, under, stuck, _ = cells
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
