# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A chain of cells of any laws over a frame at rest, in any consistent units; and what all laws
have in common.

`Chain` is the material of a memory; a lattice is what the same loops do with another law: a
measured potential, magnets between the cells. A law is a value. It knows its energy
and force for arrays, and its constants, whose type chooses the scalar formula of its force in the
loops (`mlmem.physics.jit.register_formula`).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mlmem.physics.methods import NOH_BATHE, Integrator
from mlmem.physics.methods.integrator import Cells, Forcing, align_array
from mlmem.physics.potential import Array, StateError
from mlmem.physics.stepping import NO_HELD_CELL, HeldCell


class Law(ABC):
    """An energy of one variable, per cell or per spring."""

    @abstractmethod
    def energy(self, x: ArrayLike) -> Array:
        """Return the energy at x (any shape, or with one law per cell: (..., n))."""

    @abstractmethod
    def slope(self, x: ArrayLike) -> Array:
        """Return its derivative."""


class OnSite(Law):
    """The energy of a cell at configuration D, in a chain of n cells.

    `formulas.on_site_factors(constants, j, y)` returns two factors of cell j's slope at y = D -
    origin.

    Attributes:
        origin: The configuration from which the loops count.
    """

    origin: float = 0.0

    @abstractmethod
    def constants(self, n: int) -> tuple[Any, ...]:
        """Return what the formula takes, for n cells."""


class Coupling(Law):
    """The energy of a spring between neighbours of extension e; no force at e = 0.

    `formulas.coupling_pull(constants, j, left, x, right)` returns the pull of both springs on
    cell j at x.
    """

    @abstractmethod
    def constants(self) -> tuple[Any, ...]:
        """Return what the formula takes."""


class Lattice:
    """The state of a chain, and how it advances. Its ends are free unless they are held or driven.

    Attributes:
        masses: Shape (n,).
        damping: Viscous drag on every cell: force per velocity.
        dt: Step size. It must be well below 2 / (highest angular frequency); it is not checked.
    """

    def __init__(
        self,
        on_site: OnSite,
        coupling: Coupling,
        masses: Array,
        dt: float,
        *,
        damping: float = 0.0,
        held: Sequence[int] = (),
        integrator: Integrator = NOH_BATHE,
    ) -> None:
        """Make a chain at rest with all displacements 0.

        Args:
            masses: Shape (n,), above 0.
            dt: Step size, above 0.
            damping: Viscous drag, at least 0.
            held: Sites, counted from 1, that never move.

        Raises:
            StateError: A number is out of range.
        """
        if not ((masses > 0.0).all() and 0.0 < dt < np.inf and 0.0 <= damping < np.inf):
            raise StateError(f'masses and dt must be above 0, damping at least 0; got dt = {dt:g}')
        n = len(masses)
        self.on_site, self.coupling, self.masses = on_site, coupling, masses
        self.damping = damping
        self.dt, self.integrator, self.steps_done = dt, integrator, 0
        self._arrays = integrator.make_arrays(n)
        mobility = align_array(1.0 / masses)
        mobility[np.asarray(held, dtype=np.int64) - 1] = 0.0
        self._cells = Cells(
            on_site.constants(n), coupling.constants(), align_array(np.full(n, on_site.origin)),
            mobility, align_array(np.zeros(n)), np.flatnonzero(mobility == 0.0), damping,
        )  # fmt: skip
        self._constants = integrator.constants(dt, mobility, damping)

    @property
    def displacement(self) -> Array:
        """Displacements, shape (n,); a view."""
        return self._arrays[0][1:-1]

    @property
    def velocity(self) -> Array:
        """Velocities, shape (n,); a view."""
        return self._arrays[1]

    @property
    def time(self) -> float:
        """Time since it was made."""
        return self.steps_done * self.dt

    def place(self, displacement: Array, velocity: Array | float = 0.0) -> None:
        """Set displacements and velocities, shape (n,)."""
        u, du, acceleration, *_ = self._arrays
        u[1:-1], du[:] = displacement, velocity
        if self.integrator.keeps_accelerations:
            acceleration[:] = self._cells.mobility * (self.force() - self.damping * du)

    def force(self) -> Array:
        """Return the force of the laws on every cell, shape (n,)."""
        u = self.displacement
        force = -self.on_site.slope(u)
        tension = self.coupling.slope(np.diff(u))
        force[:-1] += tension
        force[1:] -= tension
        return force

    def energy(self) -> float:
        """Return kinetic, on-site and coupling energy in all."""
        u = self.displacement
        kinetic = 0.5 * self.masses * self.velocity**2
        springs = self.coupling.energy(np.diff(u))
        return float(kinetic.sum() + self.on_site.energy(u).sum() + springs.sum())

    def advance(self, steps: int, held_cell: HeldCell | None = None) -> Array:
        """Advance by whole steps.

        A held cell is moved at `substep_times` of the run.

        Returns:
            Displacements of both ends after every step, shape (2, steps).

        Raises:
            StateError: The chain stopped being finite; the step is too long.
        """
        nodes, given = self.integrator.substeps * steps, held_cell or NO_HELD_CELL
        still, motion = np.zeros(nodes), np.array(given.motion, order='C')
        if not (motion.shape[1] <= nodes and given.site in (1, len(self.masses))):
            raise StateError('a held cell must be at an end and finish with the run')
        forcing = Forcing(still, still, given.site, motion.shape[1], motion, steps + 1)
        ends = np.empty((2, steps))
        self.integrator.advance(
            steps, self._arrays, None, self._cells, forcing, self._constants, ends, None, None,
        )  # fmt: skip
        self.steps_done += steps
        if not np.isfinite(self.velocity).all():
            raise StateError(
                f'the lattice stopped being finite: a step of {self.dt:g} is too long'
            )
        return ends
