# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The problem of the comparisons: a wall at rest and a wave packet that runs into it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from mlmem_ros.physics import CASE_II, NOH_BATHE, Chain, Design, Integrator
from mlmem_ros.physics.equilibrium import wall_profile
from mlmem_ros.physics.methods.noh_bathe import coefficients
from mlmem_ros.physics.potential import Array

STEP = 0.25
"""The step of the comparisons: the device's default."""

COEFFICIENTS = np.array(coefficients(STEP))
"""a0 ... a7 of Noh and Bathe's method."""


class Runner(NamedTuple):
    """An implementation with its own state."""

    advance: Callable[[int], None]
    displacements: Callable[[], Array]


@dataclass(frozen=True)
class Problem:
    """Eq. (1a) over an unstrained rigid substrate, both ends free.

    Attributes:
        start: Displacements at the start, at rest, shape (N,).
    """

    design: Design
    start: Array

    @classmethod
    def of_size(cls, n: int) -> Problem:
        """Return the problem on n cells: Case II, for other sizes without its gradient."""
        design = CASE_II if n == CASE_II.N else replace(CASE_II, N=n, gamma=0.0)
        x = design.sites
        packet = 0.01 * np.exp(-(((x - 0.2 * n) / 8.0) ** 2)) * np.sin(1.2 * x)
        return cls(design, wall_profile(design, 0.45 * n) + packet)

    def on_site(self, x: Any, height: Any, sin: Callable[[Any], Any]) -> Any:
        """Return the on-site force at displacements x in a solver's own arithmetic."""
        p, z = self.design, x + self.design.c
        square = z * z
        return height * sin(z * (p.a + p.b * square)) * (p.a + 3.0 * p.b * square)

    def force(self, x: Array) -> Array:
        """Return the forces at displacements x, shape (N,), without damping, in plain NumPy."""
        force = -self.on_site(x, self.height, np.sin)
        stretch = np.diff(x)
        force[:-1] += stretch
        force[1:] -= stretch
        return np.asarray(force)

    @cached_property
    def height(self) -> Array:
        """alpha_j d, shape (N,)."""
        return self.design.alpha * self.design.d

    def chain(
        self,
        substrate: str = 'rigid',
        dt: float | None = None,
        integrator: Integrator = NOH_BATHE,
    ) -> Chain:
        """Return our own chain in the initial state."""
        chain = Chain(replace(self.design, substrate=substrate), dt, integrator)
        chain.place(self.start)
        return chain
