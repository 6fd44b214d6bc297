# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An on-site law that is not the paper's: a curve of force over configuration.

Measured shells have one, and so has every formula that was tabulated. It is a cubic spline of
additions, multiplications and one division, so that it has the same bits everywhere.
"""

from __future__ import annotations

import itertools
from dataclasses import MISSING, dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..errors import DesignError, ErrorCode
from ..schema import describe_field, find_problems
from .formulas import SplineConstants
from .values import Array


@dataclass(frozen=True)
class Curve:
    """An on-site law psi(D) by its slope, the force that holds a cell at D.

    Between the forces it is a cubic spline, which repeats a cubic exactly, beyond them a straight
    line. Ground states are counted from 0; they need not be degenerate, nor two.

    Attributes:
        low, high: Configurations of the first and the last force.
        force: At equal distances, d psi'.
        d: Factor of energy and force.

    Raises:
        DesignError: A value is out of range.
    """

    low: float = describe_field(MISSING, 'configuration of the first force', low=-1e6, high=1e6)
    high: float = describe_field(MISSING, 'configuration of the last force', low=-1e6, high=1e6)
    force: tuple[float, ...] = ()
    d: float = describe_field(1.0, 'factor of energy and force', low=1e-12, high=1e9)

    def __post_init__(self) -> None:
        for problem in find_problems(self):
            raise DesignError.out_of_range(*problem)
        if self.high <= self.low:
            raise DesignError.out_of_range('high', self.high, f'above low = {self.low:g}')
        if not 8 <= (count := len(self.force)) <= 4096:
            raise DesignError.out_of_range('force', count, '8 to 4096 numbers')
        if not np.isfinite(np.array(self.force, dtype=np.float64)).all():
            raise DesignError.out_of_range('force', self.force, 'finite numbers')

    def __repr__(self) -> str:
        count = len(self.force)
        return f'Curve({count} forces from {self.low:g} to {self.high:g}, d={self.d:g})'

    # --- the spline ----------------------------------------------------------------------

    @property
    def step(self) -> float:
        """Distance between two forces."""
        return (self.high - self.low) / (len(self.force) - 1)

    @property
    def origin(self) -> float:
        """Configuration from which the loops count: one step below the first force."""
        return self.low - self.step

    @cached_property
    def pieces(self) -> Array:
        """Coefficients of the force over d (see `SplineConstants`)."""
        f = [float(each) for each in self.force]
        s = _compute_slopes(f)
        rows = [(f[0] - s[0], s[0], 0.0, 0.0)]
        for (f0, s0), (f1, s1) in itertools.pairwise(zip(f, s, strict=True)):
            rows.append((f0, s0, 3.0 * (f1 - f0) - (2.0 * s0 + s1), s0 + s1 - 2.0 * (f1 - f0)))
        rows.append((f[-1], s[-1], 0.0, 0.0))
        return np.ascontiguousarray(np.array(rows).T)

    def constants(self, height: Array) -> SplineConstants:
        """Return what `formulas.on_site_factors` takes, given alpha_j d, shape (N,)."""
        return SplineConstants(height, self.pieces, 1.0 / self.step)

    def _find_piece(self, D: ArrayLike) -> tuple[Any, Array]:
        """Return the number of the piece of every configuration, and the place in it."""
        t = (np.asarray(D, dtype=np.float64) - self.origin) * (1.0 / self.step)
        k = np.fmin(np.fmax(t, 0.0), self.pieces.shape[1] - 1.0).astype(np.int64)  # 0 for NaN
        return k, t - k

    def slope(self, D: ArrayLike) -> Array:
        """Return psi' at the configurations D (any shape)."""
        k, t = self._find_piece(D)
        p0, p1, p2, p3 = self.pieces[:, k]
        return np.asarray(self.d * (p0 + t * (p1 + t * (p2 + t * p3))))

    def stiffness(self, D: ArrayLike) -> Array:
        """Return psi'' at the configurations D."""
        k, t = self._find_piece(D)
        _, p1, p2, p3 = self.pieces[:, k]
        return np.asarray(self.d / self.step * (p1 + t * (2.0 * p2 + t * (3.0 * p3))))

    def energy(self, D: ArrayLike) -> Array:
        """Return psi at the configurations D; it is 0 in the first ground state."""
        at_zero = self._integrate_force(self.ground_states[0] if self.ground_states else self.low)
        return np.asarray(self._integrate_force(D) - at_zero)

    def _integrate_force(self, D: ArrayLike) -> Array:
        whole = (self.pieces / np.array([[1.0], [2.0], [3.0], [4.0]])).sum(axis=0)
        before = np.concatenate(([0.0], np.cumsum(whole)[:-1]))
        k, t = self._find_piece(D)
        p0, p1, p2, p3 = self.pieces[:, k]
        part = t * (p0 + t * (p1 / 2.0 + t * (p2 / 3.0 + t * (p3 / 4.0))))
        return np.asarray(self.d * self.step * (before[k] + part))

    def max_stiffness(self, reach: float) -> float:
        """Return a bound on |psi''|, which holds everywhere: beyond the curve it is constant."""
        _, p1, p2, p3 = self.pieces
        with np.errstate(divide='ignore', invalid='ignore'):
            turn = np.nan_to_num(np.clip(-p2 / (3.0 * p3), 0.0, 1.0))
        stiff = [p1 + t * (2.0 * p2 + t * 3.0 * p3) for t in (0.0, turn, 1.0)]
        return float(self.d / self.step * np.abs(stiff).max())

    # --- its ground states -----------------------------------------------------------------

    @cached_property
    def _force_zeros(self) -> list[tuple[float, bool]]:
        """Where the force is zero between the first and the last, and whether it rises there."""
        # look for a zero of the force in eight parts of an interval
        D = np.linspace(self.low, self.high, 8 * (len(self.force) - 1) + 1)
        high = self.slope(D) > 0.0
        found = []
        for k in np.flatnonzero(high[:-1] != high[1:]):
            left, right, rises = float(D[k]), float(D[k + 1]), bool(high[k + 1])
            while left < (middle := 0.5 * (left + right)) < right:
                if (self.slope(middle) > 0.0) == rises:
                    right = middle
                else:
                    left = middle
            found.append((right, rises))
        return found

    @cached_property
    def ground_states(self) -> tuple[float, ...]:
        """The configurations of the minima, rising."""
        return tuple(D for D, stable in self._force_zeros if stable)

    def ground_state(self, n: int) -> float:
        """Return the n-th ground state, from 0.

        Raises:
            DesignError: The law has no such one.
        """
        if not 0 <= n < len(self.ground_states):
            number = len(self.ground_states)
            expected = f'of a ground state of the law, which has {number}, counted from 0'
            raise DesignError(ErrorCode.CONFLICT, 'phase', n, expected)
        return self.ground_states[n]

    def barrier(self, n: int) -> float:
        """Return the barrier top between ground states n and n + 1.

        Raises:
            DesignError: The law has no such barrier.
        """
        low, high = self.ground_state(n), self.ground_state(n + 1)
        return next(D for D, stable in self._force_zeros if not stable and low < D < high)

    def wells(self, first: int, last: int) -> tuple[float, float]:
        """Return the configurations that bound the wells of a range of ground states.

        That is the barriers below the first and above the last one, or the ends of the curve.
        """
        low, high = self.ground_state(first), self.ground_state(last)
        tops = [D for D, stable in self._force_zeros if not stable]
        below, above = [D for D in tops if low > D], [D for D in tops if high < D]
        return max(below, default=self.low), min(above, default=self.high)


def _compute_slopes(f: list[float]) -> list[float]:
    """Return the slopes per interval at the knots of the spline through values of any cubic.

    At the ends it has the slope of the cubic through the four outermost values.
    """
    n = len(f)
    first = (-11.0 * f[0] + 18.0 * f[1] - 9.0 * f[2] + 2.0 * f[3]) / 6.0
    final = (11.0 * f[-1] - 18.0 * f[-2] + 9.0 * f[-3] - 2.0 * f[-4]) / 6.0
    right = [3.0 * (f[i + 1] - f[i - 1]) for i in range(1, n - 1)]
    right[0] -= first
    right[-1] -= final
    ratio = [0.25]
    right[0] *= 0.25
    for i in range(1, len(right)):  # the tridiagonal system of 1, 4, 1
        ratio.append(1.0 / (4.0 - ratio[-1]))
        right[i] = (right[i] - right[i - 1]) * ratio[i]
    for i in range(len(right) - 2, -1, -1):
        right[i] -= ratio[i] * right[i + 1]
    return [first, *right, final]
