# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The multi-stable on-site potential (Pechac & Frazier 2023, page 3), for arrays of any shape.

`formulas.on_site_factors` is the same force as the loops compute it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..errors import DesignError, ErrorCode
from .curve import Curve
from .values import Array


@dataclass(frozen=True)
class Potential:
    """The potential psi(D) = d {1 - cos[theta(D)]} with theta = a (D + c) + b (D + c)^3.

    Its ground states are degenerate and lie where theta is a multiple of 2 pi, its barriers
    where theta is an odd multiple of pi.

    Attributes:
        a: Linear phase coefficient, positive.
        b: Cubic phase coefficient; it makes the ground states differ in stiffness.
        c: Offset of the configuration, in lattice constants.
        d: Half the barrier height, energy in k_r (lattice constant)^2.
    """

    a: float
    b: float
    c: float
    d: float

    @staticmethod
    def from_function(
        psi: Callable[[Array], ArrayLike], low: float, high: float, number: int = 1024
    ) -> Curve:
        """Return a potential of one's own, for `Design(law=...)`.

        Its ground states are found and counted from 0, the lowest configuration. A `Design` with
        it is in the ground states 0 and 1 unless it names another `phase`.

        Args:
            psi: Energy at configurations, which are an array from `low` to `high`, or one of them
                if it takes no arrays; the design's d is a factor on it.
            low: Least configuration, in lattice constants.
            high: Greatest configuration. Beyond both the force goes on as a straight line.
            number: Number of points, equally spaced, at which the slope of psi is taken.

        Raises:
            DesignError: A slope is not finite, or a number is out of range.
        """
        D = np.linspace(low, high, number)
        h = 0.25 * (high - low) / (number - 1)
        inside = np.clip(D, low + 2.0 * h, high - 2.0 * h)
        try:
            psi(inside)
        except (TypeError, ValueError):
            psi = np.vectorize(psi, otypes=[np.float64])
        # the slope of the quartic through five points around each, and at the two ends
        values = np.array([psi(inside + node * h) for node in (-2, -1, 0, 1, 2)], dtype=np.float64)
        slope = values[0] - 8.0 * values[1] + 8.0 * values[3] - values[4]
        at_end = np.array([-25.0, 48.0, -36.0, 16.0, -3.0])
        slope[0], slope[-1] = np.sum(at_end * values[:, 0]), -np.sum(at_end * values[::-1, -1])
        return Curve(low, high, tuple((slope / (12.0 * h)).tolist()))

    def energy(self, D: ArrayLike) -> Array:
        """Return psi at the configurations D (any shape)."""
        theta, _, _ = self._compute_phase(D)
        return self.d * (1.0 - np.cos(theta))

    def slope(self, D: ArrayLike) -> Array:
        """Return psi' at the configurations D: the on-site force is -alpha psi'."""
        theta, slope, _ = self._compute_phase(D)
        return self.d * np.sin(theta) * slope

    def stiffness(self, D: ArrayLike) -> Array:
        """Return psi'' at the configurations D."""
        theta, slope, curvature = self._compute_phase(D)
        return self.d * (np.cos(theta) * slope**2 + np.sin(theta) * curvature)

    def _compute_phase(self, D: ArrayLike) -> tuple[Array, Array, Array]:
        y = np.asarray(D, dtype=np.float64) + self.c
        return y * (self.a + self.b * y * y), self.a + 3.0 * self.b * y * y, 6.0 * self.b * y

    @property
    def origin(self) -> float:
        """Configuration from which the loops count, -c."""
        return -self.c

    def constants(self, height: Array) -> tuple[Array, float, float]:
        """Return what `formulas.on_site_factors` takes, given alpha_j d, shape (N,)."""
        return height, self.a, self.b

    def max_stiffness(self, reach: float) -> float:
        """Return a bound on the size of psi'' where D is at most `reach` from the origin."""
        slope = abs(self.a + 3.0 * self.b * reach * reach)
        steepest = max(self.a, slope)  # a + 3 b y^2 has its extremes at the ends
        return self.d * math.hypot(steepest**2, 6.0 * self.b * reach)

    def ground_state(self, n: int) -> float:
        """Return the n-th ground state: the configuration where theta = 2 pi n.

        Raises:
            DesignError: The potential has no n-th ground state.
        """
        return self._solve_configuration(2.0 * math.pi * n, f'ground state {n}')

    def barrier(self, n: int) -> float:
        """Return the barrier top between ground states n and n + 1.

        Raises:
            DesignError: The potential has no such barrier.
        """
        return self._solve_configuration(math.pi * (2 * n + 1), f'barrier above ground state {n}')

    def wells(self, first: int, last: int) -> tuple[float, float]:
        """Return the configurations that bound the wells of a range of ground states.

        That is the barriers below the first and above the last one; where theta turns before it
        reaches one, that turning point.
        """
        edges = (math.pi * (2 * first - 1), math.pi * (2 * last + 1))
        low, high = (
            math.copysign(self._turn, theta) - self.c
            if abs(theta) >= self._max_phase
            else self._solve_configuration(theta, 'edge')
            for theta in edges
        )
        return low, high

    @property
    def _turn(self) -> float:
        """D + c where theta turns; infinite if it rises forever."""
        return math.sqrt(-self.a / (3.0 * self.b)) if self.b < 0.0 else math.inf

    @property
    def _max_phase(self) -> float:
        """Theta at that turning point."""
        return 2.0 / 3.0 * self.a * self._turn

    def _solve_configuration(self, theta: float, what: str) -> float:
        """Solve the cubic a y + b y^3 = theta on its rising branch through the origin."""
        if abs(theta) >= (most := self._max_phase):
            raise DesignError(
                ErrorCode.CONFLICT, 'b', self.b,
                f'greater, or the potential has no {what}: its theta only reaches {most:.4g}, and '
                f'{abs(theta):.4g} is needed',
            )  # fmt: skip
        y = theta / self.a
        if abs(self.b) * y * y > 1e-9 * self.a:  # else the cubic term is left to Newton
            y = _solve_cubic(self.a / self.b, -theta / self.b, smallest=self.b < 0.0)
        for _ in range(3):  # Newton polishes the closed form to the last bit
            y -= (y * (self.a + self.b * y * y) - theta) / (self.a + 3.0 * self.b * y * y)
        return y - self.c


def _solve_cubic(p: float, q: float, *, smallest: bool) -> float:
    """Return a real root of y^3 + p y + q: the only one, or the smallest in size (Cardano)."""
    if not smallest:  # p > 0: one real root, in Viete's hyperbolic form, which never cancels
        scale = math.sqrt(p / 3.0)
        return -2.0 * scale * math.sinh(math.asinh(1.5 * q / (p * scale)) / 3.0)
    scale = math.sqrt(-p / 3.0)
    phase = math.acos(max(-1.0, min(1.0, 1.5 * q / (p * scale))))
    return min(
        (2.0 * scale * math.cos((phase - 2.0 * math.pi * k) / 3.0) for k in range(3)), key=abs
    )
