# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The problem of the kernel comparisons: a wall at rest and a wave packet that runs into it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from ..physics import CASE_II, NOH_BATHE, Chain, Design, Integrator
from ..physics.equilibrium import wall_profile
from ..physics.methods.noh_bathe import coefficients
from ..physics.potential import Array

STEP = 0.25
"""The step of the comparisons: the device's default."""


class Arrays(NamedTuple):
    """State and work space, in the order the plain kernels take them.

    u and u_p have a ghost cell at either end.
    """

    u: Array
    v: Array
    A: Array
    u_p: Array
    v_p: Array
    A_p: Array


class Runner(NamedTuple):
    """An implementation with its own state.

    Attributes:
        advance: Advances by a number of steps.
        displacements: Returns the present displacements, shape (N,).
    """

    advance: Callable[[int], None]
    displacements: Callable[[], Array]


@dataclass(frozen=True)
class Problem:
    """Eq. (1a) over an unstrained rigid substrate, both ends free.

    Attributes:
        design: The element.
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

    @property
    def height(self) -> Array:
        """alpha_j d, shape (N,)."""
        return self.design.alpha * self.design.d

    def arrays(self) -> Arrays:
        """Return a state at rest with the accelerations of `start`, as `chain` has it."""
        n = self.design.N
        chain = self.chain()
        u = np.concatenate(([0.0], self.start, [0.0]))
        acceleration = chain.state()[2].copy()
        return Arrays(u, np.zeros(n), acceleration, np.zeros(n + 2), np.zeros(n), np.zeros(n))

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


def constants(dt: float = STEP) -> Array:
    """Return a0 ... a7 of Noh and Bathe's method."""
    return np.array(coefficients(dt))
