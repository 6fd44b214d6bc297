# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The material: two coupled chains with a state, advanced in fixed steps."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .design import Design
from .energy import metamaterial_force, substrate_force
from .errors import DesignError, StateError
from .field import Field, aligned
from .integrator import Integrator
from .noh_bathe import NOH_BATHE
from .potential import Array
from .specimen import LARGEST_OFFSET, Specimen
from .stepping import STABILITY_MARGIN, default_step, farthest_reach, stable_step


@dataclass(frozen=True)
class Drive:
    """A cell held at a prescribed motion for the first sub-steps of a run.

    Attributes:
        site: The driven cell: 1 or N.
        motion: Its displacement and velocity at the first m of the run's `substep_times`, shape
            (2, m); it is free afterwards. PEFRL lets go between two steps only: a step that is
            not held to its end is free from its start.
    """

    site: int
    motion: Array


class Chain:
    """The state of an element's material, and how it advances.

    Attributes:
        design: The element.
        specimen: The element as it was made and has become; set it with `become`.
        dt: Step size in time units.
        integrator: How it is stepped.
        steps_done: Steps since the chain was made: its clock.
        V_N: Present displacement of the substrate's end.
        inputs: What the last run was driven by: the arguments of `advance`.
    """

    def __init__(
        self, design: Design, dt: float | None = None, integrator: Integrator = NOH_BATHE
    ) -> None:
        """Make a blank chain at rest: every cell in the inactive phase.

        Args:
            design: The element.
            dt: Step size in time units; by default `default_step(design, integrator)`.
            integrator: How it is stepped.

        Raises:
            DesignError: The step is not positive or beyond the stability limit.
        """
        limit = stable_step(design, integrator)
        dt = default_step(design, integrator) if dt is None else dt
        if not 0.0 < dt <= limit:
            raise DesignError(
                f'dt must be above 0 and at most {limit:.5g}, {STABILITY_MARGIN:g} of the '
                f'stability limit of the {design.substrate} substrate; got {dt:g}'
            )
        self.design = design
        self.specimen = Specimen(design)
        self.dt = dt
        self.integrator = integrator
        self.steps_done = 0
        self.V_N = 0.0
        self.inputs: tuple[Array, Drive | None, Array | None] = (np.empty(0), None, None)
        n = design.N
        self._height, self._offset, self._shape = (aligned(np.zeros(n)) for _ in range(3))
        self._springs = aligned(np.zeros(n + 1))
        self._fill()
        self._metamaterial = Field(n, integrator.work(n))
        self._substrate = Field(n, integrator.work(n)) if design.substrate == 'elastic' else None
        self._no_motion = np.zeros((2, 1))
        self.v[:] = design.D_s1

    # --- the state -----------------------------------------------------------------------

    @property
    def time(self) -> float:
        """Time since the chain was made, in time units."""
        return self.steps_done * self.dt

    @property
    def v(self) -> Array:
        """Displacements v_j of the metamaterial, shape (N,): a view."""
        return self._metamaterial.u[1:-1]

    @property
    def velocity(self) -> Array:
        """Velocities of the metamaterial, shape (N,): a view."""
        return self._metamaterial.velocity

    @property
    def V(self) -> Array:
        """Displacements V_j of the substrate, shape (N,)."""
        if self._substrate is not None:
            return self._substrate.u[1:-1]
        return self.V_N * self.specimen.strain_shape

    @property
    def substrate_velocity(self) -> Array:
        """Velocities of the elastic substrate, shape (N,); zeros for the rigid one.

        Those of its two ends, which are moved by the frame and the actuator, read zero.
        """
        return self._substrate.velocity if self._substrate else np.zeros(self.design.N)

    @property
    def configuration(self) -> Array:
        """Configuration Delta_j = v_j - V_j, shape (N,)."""
        return self.v - self.V

    def end(self, site: int) -> float:
        """Return the displacement of a cell."""
        return float(self._metamaterial.u[site])

    def place(self, v: Array, V_N: float = 0.0) -> None:
        """Set the displacements, at rest, over the substrate strained quasi-statically.

        Args:
            v: Displacements of the metamaterial, shape (N,), finite.
            V_N: Displacement of the substrate's end.

        Raises:
            StateError: A wrong shape or a value that is not finite; nothing is changed.
        """
        state = np.zeros_like(self.state())
        if np.shape(v) != (self.design.N,):
            raise StateError(f'v must have shape ({self.design.N},); got {np.shape(v)}')
        if not (np.isfinite(v).all() and math.isfinite(V_N)):
            raise StateError('v and V_N must be finite; got NaN or infinity')
        V = V_N * self.specimen.strain_shape
        state[0] = v
        state[2] = metamaterial_force(self.specimen, state[0], V) / self.specimen.masses
        if self._substrate is not None:
            state[3] = V
            state[5, 1:-1] = substrate_force(self.specimen, state[0], V)[1:-1]
        self.restore(state, V_N=V_N, steps_done=self.steps_done)

    def state(self) -> Array:
        """Return a copy of all that the future depends on beside V_N and the clock.

        Returns:
            Rows displacement, velocity, acceleration of the metamaterial, then the same of an
            elastic substrate: shape (3, N) or (6, N). PEFRL knows no accelerations: zeros.
        """
        return self._rows()

    def restore(self, state: Array, *, V_N: float, steps_done: int) -> None:
        """Set the state that `state` returned, to the bit; by either integrator.

        Raises:
            StateError: A wrong shape or a value that is not finite; nothing is changed.
        """
        wanted = (6 if self._substrate is not None else 3, self.design.N)
        if np.shape(state) != wanted:
            raise StateError(f'the state must have shape {wanted}; got {np.shape(state)}')
        if not (np.isfinite(state).all() and math.isfinite(V_N)):
            raise StateError('the state must be finite; got NaN or infinity')
        self._set(state)
        for field in (self._metamaterial, self._substrate):
            if field is not None and not self.integrator.keeps_accelerations:
                field.acceleration[:] = 0.0
        self.V_N = float(V_N)
        self.steps_done = int(steps_done)

    def _rows(self) -> Array:
        rows = self._metamaterial.rows()
        if self._substrate is not None:
            rows += self._substrate.rows()
        return np.array(rows)

    def _set(self, state: Array) -> None:
        """Set the rows that `_rows` gave."""
        self._metamaterial.set(state[:3])
        if self._substrate is not None:
            self._substrate.set(state[3:])

    def become(self, specimen: Specimen) -> None:
        """Let another specimen of the design take the place of this one, in the same state.

        Cells that are stuck stop where they are.

        Raises:
            DesignError: It is of another design, or the step is beyond its stability limit;
                nothing is changed.
        """
        self.check(specimen)
        self.specimen = specimen
        self._fill()
        self._metamaterial.velocity[self._stuck] = 0.0
        self._metamaterial.acceleration[self._stuck] = 0.0

    def check(self, specimen: Specimen) -> None:
        """Raise `DesignError` for a specimen that `become` would refuse."""
        if specimen.design != self.design:
            raise DesignError('the specimen must be of the design of the chain')
        if self.dt > (limit := stable_step(specimen, self.integrator)):
            raise DesignError(
                f'the specimen needs a step of at most {limit:.5g}; the chain runs with '
                f'{self.dt:g}'
            )

    def _fill(self) -> None:
        """Give the kernel the arrays of the specimen."""
        specimen = self.specimen
        self._height[:] = specimen.alpha * self.design.d
        self._offset[:] = specimen.offsets
        self._shape[:] = specimen.strain_shape
        self._springs[1:-1] = specimen.s
        self._reach = farthest_reach(specimen, self.integrator, self.dt) + LARGEST_OFFSET
        mobility = aligned(1.0 / specimen.masses)
        self._stuck = np.flatnonzero(mobility == 0.0)
        self._constants = self.integrator.constants(self.dt, mobility, specimen.eta)
        if self.design.substrate == 'elastic':
            self._constants += self.integrator.substrate_constants(self.dt, specimen.eta)

    # --- time ----------------------------------------------------------------------------

    def advance(self, V_N: Array, drive: Drive | None = None, shake: Array | None = None) -> Array:
        """Advance by whole steps.

        Args:
            V_N: Displacement of the substrate's end at the `substep_times`, shape (m steps,)
                with m = integrator.substeps, finite.
            drive: A cell held at a prescribed motion at the start of the run.
            shake: Acceleration of the base at the same times, shape (m steps,), finite; the
                displacements are those relative to the base. None for a base at rest.

        Returns:
            Displacements v_1 and v_N after every step, shape (2, steps).

        Raises:
            StateError: The inputs have the wrong shape or are not finite (nothing is changed),
                or drive a cell so far that the step is stable no more; the chain is then as it
                was before.
        """
        self.check_inputs(V_N, drive, shake)
        self.inputs = V_N, drive, shake
        before = self._rows(), self.V_N, self.steps_done
        V_N = _plain(V_N)
        base = np.zeros(len(V_N)) if shake is None else _plain(shake)
        motion = self._no_motion if drive is None else _plain(drive.motion)
        steps = len(V_N) // self.integrator.substeps
        site, driven = (1, 0) if drive is None else (drive.site, motion.shape[1])
        ends = np.empty((2, steps))
        p = self.design
        if self._substrate is None:
            loop, fields, strained = self.integrator.rigid, self._metamaterial.arrays, self._shape
        else:
            loop, strained = self.integrator.elastic, self._springs
            fields = self._metamaterial.arrays + self._substrate.arrays
        loop(
            steps,
            p.N,
            *fields,
            self._height,
            self._offset,
            self._stuck,
            strained,
            V_N,
            base,
            p.a,
            p.b,
            p.c,
            site,
            driven,
            motion,
            ends,
            *self._constants,
        )
        if steps:
            self.V_N = float(V_N[-1])
        self.steps_done += steps
        if loss := self._loss():
            lost, (state, self.V_N, self.steps_done) = self.steps_done, before
            self._set(state)
            raise StateError(
                f'{loss} before step {lost}: it is strained or shaken too hard; the chain is as '
                f'it was at step {self.steps_done}'
            )
        return ends

    def _loss(self) -> str:
        """Return what is wrong with the state; empty for one that can go on."""
        # What is not finite anywhere reaches a velocity of the metamaterial within the sub-step.
        if not np.isfinite(self.velocity).all():
            return 'the chain stopped being finite'
        if not np.abs(self.v - self.V + self.design.c).max() <= self._reach:
            return f'a cell left the range in which a step of {self.dt:.4g} is stable'
        return ''

    def rest(self, steps: int) -> Array:
        """Advance by whole steps with the substrate's end held where it is."""
        return self.advance(np.full(self.integrator.substeps * steps, self.V_N))

    def check_inputs(self, V_N: Array, drive: Drive | None, shake: Array | None = None) -> None:
        """Raise `StateError` for what `advance` would refuse."""
        substeps = self.integrator.substeps
        if V_N.ndim != 1 or len(V_N) % substeps:
            raise StateError(f'V_N must have shape ({substeps} steps,); got {V_N.shape}')
        if not np.isfinite(V_N).all():
            raise StateError('V_N must be finite; got NaN or infinity')
        if shake is not None and not (shake.shape == V_N.shape and np.isfinite(shake).all()):
            raise StateError(f'shake must have shape {V_N.shape} and be finite')
        if drive is None:
            return
        if drive.site not in (1, self.design.N):
            raise StateError(f'site must be 1 or N = {self.design.N}; got {drive.site}')
        if drive.motion.ndim != 2 or drive.motion.shape[0] != 2:
            raise StateError(f'motion must have shape (2, m); got {drive.motion.shape}')
        if drive.motion.shape[1] > len(V_N):
            raise StateError(
                f'motion must end with the run, {len(V_N)} sub-steps; got {drive.motion.shape[1]}'
            )
        if not np.isfinite(drive.motion).all():
            raise StateError('motion must be finite; got NaN or infinity')


def _plain(array: Array) -> Array:
    """Return a copy of the one kind (contiguous, writeable) that the kernels are compiled for."""
    return np.array(array, dtype=np.float64, order='C')
