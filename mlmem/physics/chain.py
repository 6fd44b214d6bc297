# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The material: two coupled chains with a state, advanced in fixed steps."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any, cast

import numpy as np

from ..errors import DesignError, ErrorCode, StateError
from .cells import (
    MAX_REST_SPEED,
    Cells,
    Chained,
    Forcing,
    align_array,
    is_balanced,
    make_chain_arrays,
)
from .design import Design
from .jit import DISABLED, is_cached
from .pefrl import NODES, SUBSTEPS_PER_STEP, advance, compute_constants
from .specimen import MAX_OFFSET, Material, Specimen, as_specimen
from .stepping import (
    NO_INPUTS,
    STABILITY_MARGIN,
    HeldCell,
    Inputs,
    copy_contiguous,
    default_step,
    farthest_reach,
    require_finite,
    stable_step,
)
from .values import Array


class Chain:
    """The state of an element's material, and how it advances.

    Attributes:
        specimen: The element in its present condition; changed by `set_specimen`.
        V_N: Current displacement of the substrate's end.
    """

    def __init__(self, material: Material, dt: float | None = None) -> None:
        """Make a chain at rest whose cells are all in the ground state of the inactive phase.

        Where a specimen's own ground states differ, `place(make_blank(specimen))` makes a blank.

        Args:
            dt: Step size in time units; by default `default_step(material)`.

        Raises:
            DesignError: The step is not positive or beyond the stability limit.
        """
        specimen = as_specimen(material)
        design = specimen.design
        limit = stable_step(specimen)
        dt = default_step(specimen) if dt is None else dt
        if not 0.0 < dt <= limit:
            raise DesignError.out_of_range(
                'dt',
                dt,
                f'above 0 and at most {limit:.5g}, {STABILITY_MARGIN:g} of the stability limit of '
                f'the {design.substrate} substrate',
            )
        self.design = design
        self.specimen = specimen
        self.dt = dt
        self.steps_done = 0
        self.V_N = 0.0
        self._metamaterial = make_chain_arrays(design.N)
        elastic = design.substrate == 'elastic'
        self._substrate = make_chain_arrays(design.N) if elastic else None
        self._build_cells()
        self.v[:] = design.D_s1

    # --- the state -----------------------------------------------------------------------

    @property
    def time(self) -> float:
        """Time since the chain was made, in time units."""
        return self.steps_done * self.dt

    @property
    def v(self) -> Array:
        """Displacements v_j of the metamaterial, shape (N,); a view."""
        return self._metamaterial[0][1:-1]

    @property
    def velocity(self) -> Array:
        """Velocities of the metamaterial, shape (N,); a view."""
        return self._metamaterial[1]

    @property
    def V(self) -> Array:
        """Displacements V_j of the substrate, shape (N,)."""
        if self._substrate is not None:
            return self._substrate[0][1:-1]
        return self.V_N * self.specimen.strain_shape

    @property
    def substrate_velocity(self) -> Array:
        """Velocities of the elastic substrate, shape (N,); zeros for the rigid one.

        Those of its two ends, which are moved by the frame and the actuator, read zero.
        """
        return self._substrate[1] if self._substrate else np.zeros(self.design.N)

    @property
    def configuration(self) -> Array:
        """Configuration Delta_j = v_j - V_j, shape (N,)."""
        return self.v - self.V

    def end(self, site: int) -> float:
        """Return the displacement of a cell."""
        return float(self._metamaterial[0][site])

    def place(self, v: Array, V_N: float = 0.0) -> None:
        """Set the displacements, at rest, over the substrate strained quasi-statically.

        Args:
            v: Displacements of the metamaterial, shape (N,), finite.
            V_N: Displacement of the substrate's end.

        Raises:
            StateError: A wrong shape or a value that is not finite; nothing is changed.
        """
        require_finite('v', v, (self.design.N,))
        require_finite('V_N', V_N, ())
        state = np.zeros_like(self.state())
        state[0] = v
        if self._substrate is not None:
            state[2] = V_N * self.specimen.strain_shape
        self.restore(state, V_N=V_N, steps_done=self.steps_done)
        self._join_stuck_cells()

    def state(self) -> Array:
        """Return a copy of everything the future depends on, except V_N and the clock.

        Returns:
            Rows displacement and velocity of the metamaterial, then the same of an elastic
            substrate: shape (2, N) or (4, N).
        """
        return np.array(self._list_rows())

    def restore(self, state: Array, *, V_N: float, steps_done: int) -> None:
        """Set a state that `state` returned, to the bit.

        Raises:
            StateError: A wrong shape or a value that is not finite; nothing is changed.
        """
        require_finite('state', state, (2 * len(self._list_chains()), self.design.N))
        require_finite('V_N', V_N, ())
        self._set_rows(state)
        self.V_N = float(V_N)
        self.steps_done = int(steps_done)

    def _list_chains(self) -> list[Chained]:
        """Return the arrays of the metamaterial, and of an elastic substrate."""
        return [each for each in (self._metamaterial, self._substrate) if each is not None]

    def _list_rows(self) -> list[Array]:
        """Return the rows of a state; views."""
        return [row for u, velocity, _ in self._list_chains() for row in (u[1:-1], velocity)]

    def _set_rows(self, state: Iterable[Array]) -> None:
        """Set the rows of a state; the loop renews the ghost cells."""
        for row, values in zip(self._list_rows(), state, strict=True):
            row[:] = values

    def set_specimen(self, material: Material) -> None:
        """Replace the specimen by another one of the same design, in the same state.

        Stuck cells stop on the substrate, where they are.

        Raises:
            DesignError: It is of another design, or the step is beyond its stability limit;
                nothing is changed.
        """
        specimen = as_specimen(material)
        self.check(specimen)
        self.specimen = specimen
        self._build_cells()
        self._join_stuck_cells()

    def _join_stuck_cells(self) -> None:
        """Give the stuck cells one motion with the substrate under them."""
        stuck, velocity = self._cells.stuck, self.velocity
        if self._substrate is None:
            velocity[stuck] = 0.0
            return
        mobility, below = self._cells.mobility[stuck], self._substrate[1]
        common = velocity[stuck] + mobility * below[stuck]
        velocity[stuck] = below[stuck] = common / (1.0 + mobility)

    def check(self, specimen: Specimen) -> None:
        """Raise `DesignError` for a specimen that `set_specimen` would refuse."""
        if specimen.design != self.design:
            expected = 'of the design of the chain'
            raise DesignError(ErrorCode.CONFLICT, 'specimen', specimen, expected)
        if self.dt > (limit := stable_step(specimen)):
            expected = f'at most {limit:.5g} for this specimen'
            raise DesignError(ErrorCode.CONFLICT, 'dt', self.dt, expected)

    def _build_cells(self) -> None:
        """Build the loop's arguments from the specimen."""
        made, design = self.specimen, self.design
        mobility, stuck = align_array(1.0 / made.masses), made.stuck_indices
        elastic = design.substrate == 'elastic'
        if not elastic:
            mobility[stuck] = 0.0
        under = np.concatenate(([0.0], made.s, [0.0])) if elastic else made.strain_shape
        p = made.potential
        self._cells = Cells(
            p.constants(align_array(made.alpha * p.d)), tuple(map(align_array, made.springs)),
            align_array(made.offsets + p.origin), mobility, align_array(under),
            stuck,
        )  # fmt: skip
        self._constants = compute_constants(self.dt, mobility, made.eta)
        reach = farthest_reach(made, self.dt) + MAX_OFFSET
        self._range = -reach + p.origin, reach + p.origin

    def set_damping(self, factors: Array) -> None:
        """Damp every cell by its own factor times eta, shape (N,), until `set_specimen`.

        Raises:
            DesignError: A factor is not above 0.
        """
        if not (factors > 0.0).all():
            worst = float(factors.min())
            raise DesignError.out_of_range('factors', worst, 'above 0')
        eta = self.specimen.eta * factors
        self._constants = compute_constants(self.dt, self._cells.mobility, eta)

    # --- time ----------------------------------------------------------------------------

    def advance(
        self,
        V_N: Array,
        held_cell: HeldCell | None = None,
        shake: Array | None = None,
        ticks: int = 0,
    ) -> Array:
        """Advance by whole steps.

        Args:
            V_N: Displacement of the substrate's end at the `substep_times`, shape (m steps,)
                with m = SUBSTEPS_PER_STEP, finite.
            held_cell: A cell held at a prescribed motion at the start of the run.
            shake: Acceleration of the base at the same times, shape (m steps,), finite; the
                displacements are those relative to the base. None for a base at rest.
            ticks: Number of equal parts of the run: the range of all cells is checked at the end
                of each, and an error in any undoes the whole run. A tick that begins `at_rest`,
                and in which nothing moves the chain, is passed by. By default there are no ticks:
                the range is checked at the end, and the chain never rests.

        Returns:
            Displacements v_1 and v_N after every step, shape (2, steps).

        Raises:
            StateError: The inputs have the wrong shape, are not finite, or drive a cell so far
                that the step becomes unstable. The chain is as it was before.
        """
        inputs = Inputs.from_arguments(V_N, held_cell, shake, self.design.N)
        before = [row.copy() for row in self._list_rows()], self.V_N, self.steps_done
        steps = len(V_N) // SUBSTEPS_PER_STEP
        every = max(1, steps // ticks) if ticks else 0
        ends, strayed = self._advance_stretch(inputs, every)
        while not strayed and ends.shape[1] < steps:
            left = inputs.skip_substeps(SUBSTEPS_PER_STEP * ends.shape[1])
            part, strayed = self._advance_stretch(left, every)
            ends = np.concatenate((ends, part), axis=1)
        # A non-finite value anywhere reaches a velocity of the metamaterial within the sub-step.
        finite = np.isfinite(self.velocity).all()
        if strayed or not finite:
            loss = (
                f'a cell left the range in which a step of {self.dt:.4g} is stable'
                if finite
                else 'the chain stopped being finite'
            )
            lost, (rows, self.V_N, self.steps_done) = self.steps_done, before
            self._set_rows(rows)
            why = (
                f'{loss} before step {lost}: it is strained or shaken too hard; the chain is as '
                f'it was at step {self.steps_done}'
            )
            raise StateError(reason=why)
        return ends

    def _advance_stretch(self, inputs: Inputs, every: int) -> tuple[Array, bool]:
        """Advance until a rest begins or ends; `every` is the number of steps of a tick, or 0."""
        ticks = 0
        if every and self.at_rest:
            ticks = inputs.count_still_substeps(self.V_N) // (SUBSTEPS_PER_STEP * every)
        if ticks:
            steps = every * ticks
            self.pass_by(steps)
            return np.repeat([[self.end(1)], [self.end(self.design.N)]], steps, axis=1), False
        ends = np.empty((2, len(inputs.V_N) // SUBSTEPS_PER_STEP))
        steps, strayed = advance(*self._build_arguments(inputs, ends, every))
        if steps:
            self.V_N = float(inputs.V_N[SUBSTEPS_PER_STEP * steps - 1])
        self.steps_done += steps
        return ends[:, :steps], strayed

    @property
    def at_rest(self) -> bool:
        """Whether every velocity and acceleration is below `MAX_REST_SPEED`.

        It follows from the state alone, so it does not matter how time was divided into runs.
        """
        if not abs(self.velocity[0]) < MAX_REST_SPEED:  # mostly it shows here
            return False
        if not all(
            np.abs(v).max() < MAX_REST_SPEED for _, v, _ in self._list_chains()
        ):  # also for NaN
            return False
        substrate = None if self._substrate is None else self._substrate[0]
        return is_balanced(self._metamaterial[0], substrate, self._cells, self.V_N)

    def _build_arguments(self, inputs: Inputs, ends: Array, every: int = 0) -> tuple[Any, ...]:
        """Return the arguments of the loop; `every` is the number of steps of a tick, or 0."""
        V_N, held_cell, shake = inputs
        motion = copy_contiguous(held_cell.motion)
        look, slow = (every, MAX_REST_SPEED) if every else (max(1, ends.shape[1]), 0.0)
        forcing = Forcing(
            V_N, shake, held_cell.site, motion.shape[1], motion,
            look, *self._range, slow, self.V_N,
        )  # fmt: skip
        chains = self._metamaterial, self._substrate
        losses = self._friction(), self._compute_drag(V_N)
        return ends.shape[1], *chains, self._cells, forcing, self._constants, ends, *losses

    def _friction(self) -> tuple[float, float] | None:
        """Return the dry friction, and the velocity below which it is viscous, or None.

        A step takes at most half of the velocity away, so that friction never drives a cell.
        """
        force = self.design.friction
        mass = float(self.specimen.masses.min())
        return (force, 2.0 * force * self.dt / mass) if force else None

    def _compute_drag(self, V_N: Array) -> Array | None:
        """Return eta times the velocity of the substrate's end, if damping acts on v - V."""
        if not self.specimen.damped_by_substrate:
            return None
        gaps = self.dt * np.diff(NODES, prepend=0.0)
        taken = np.tile(gaps, len(V_N) // len(gaps))  # the same in any cut of runs
        return np.asarray(self.specimen.eta * np.diff(V_N, prepend=self.V_N) / taken)

    def pass_by(self, steps: int) -> None:
        """Let the clock go on by whole steps of ticks in which the chain is at rest."""
        for _, velocity, _ in self._list_chains():
            velocity[:] = 0.0
        self.steps_done += steps

    def advance_steps(self, steps: int) -> Array:
        """Advance by whole steps with the substrate's end held where it is."""
        return self.advance(np.full(SUBSTEPS_PER_STEP * steps, self.V_N))


def is_kernel_cached(design: Design) -> bool:
    """Return whether the loop for an element of a design is already compiled, here or on disk."""
    return is_cached(advance, *Chain(design)._build_arguments(NO_INPUTS, np.empty((2, 0))))


def find_cache_folder() -> Path | None:
    """Return where the machine code of the loop is cached; None if it cannot be."""
    path = None if DISABLED else cast(Any, advance).stats.cache_path
    return None if path is None else Path(path)
