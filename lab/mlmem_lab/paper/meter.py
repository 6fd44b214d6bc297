# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A chain that keeps the books of its energy, step by step, while a device works on it."""

from __future__ import annotations

import numpy as np

from mlmem import MemoryElement
from mlmem.instrument.drivers import Simulation
from mlmem.instrument.transducer import Transducer
from mlmem.physics import NOH_BATHE, Chain, Design, HeldCell, Integrator
from mlmem.physics.energy import end_force, energy
from mlmem.physics.equilibrium import metamaterial_force
from mlmem.physics.potential import Array, StateError
from mlmem.physics.stepping import Inputs


class MeteredChain(Chain):
    """A chain with the same bits that sums what goes into it and what becomes heat.

    The books come from the Lagrangian alone, not from the accelerations of the loops. Powers are
    integrated by the trapezoidal rule over the steps, of second order. Energies are in
    k_r (lattice constant)^2.

    Attributes:
        actuator_work: Work on the substrate's end so far, F dV_N.
        transducer_work: Work on the driven cell: against springs, damping and inertia.
        shake_work: Work of the base's acceleration.
        heat: What the damping took of every cell, shape (N,).
        substrate_heat: What it took of the substrate under it (Eq. 1b), shape (N,): of a rigid one
            by its quasi-static velocity.
    """

    def __init__(
        self, design: Design, dt: float | None = None, integrator: Integrator = NOH_BATHE
    ) -> None:
        """Make a blank chain at rest, as `Chain` does."""
        super().__init__(design, dt, integrator)
        self.actuator_work = self.transducer_work = self.shake_work = 0.0
        self.heat, self.substrate_heat = np.zeros(design.N), np.zeros(design.N)

    def advance(
        self,
        V_N: Array,
        held_cell: HeldCell | None = None,
        shake: Array | None = None,
        looks: int = 0,
    ) -> Array:
        """Advance by whole steps as `Chain.advance` does; it looks at its cells after each.

        Raises:
            StateError: As there, but the chain is as it was before the step.
        """
        substeps = self.integrator.substeps
        Inputs(V_N, held_cell, shake).check(self.design.N, substeps)
        base = np.zeros_like(V_N) if shake is None else shake
        steps = len(V_N) // substeps
        states, end, ends = [self._moving()], [self.V_N], np.empty((2, steps))
        for k in range(steps):
            now = slice(substeps * k, substeps * (k + 1))
            held = held_cell and HeldCell(held_cell.site, held_cell.motion[:, now])
            ends[:, k : k + 1], strayed = self._advance_stretch(
                Inputs(V_N[now], held, base[now]), 0
            )
            if strayed or not np.isfinite(self.velocity).all():
                raise StateError(f'a step of {self.dt:.4g} is too long for what drives the chain')
            states.append(self._moving())
            end.append(self.V_N)
        base = np.concatenate((base[:1], base[substeps - 1 :: substeps]))
        self._book_energy(np.stack(states, 1), np.array(end), held_cell, base)
        return ends

    def _moving(self) -> Array:
        """Return v, its velocity, V and its velocity, shape (4, N)."""
        return np.array((self.v, self.velocity, self.V, self.substrate_velocity))

    def _book_energy(
        self, states: Array, V_N: Array, held_cell: HeldCell | None, base: Array
    ) -> None:
        """Add what happened between m moments, at which the cells were so, shape (4, m, N)."""
        (v, w, V, W), made = states, self.specimen
        masses = made.masses
        if held_cell is not None:
            held = -(-held_cell.motion.shape[1] // self.integrator.substeps)
            j, driven = held_cell.site - 1, slice(held + 1)
            speed = w[driven, j]
            pull = -metamaterial_force(made, v[driven], V[driven])[:, j]
            pull += made.eta * speed + masses[j] * base[driven]
            kinetic = 0.5 * float(masses[j] * (speed[-1] ** 2 - speed[0] ** 2))
            self.transducer_work += float(_midpoint_means(pull) @ np.diff(v[driven, j])) + kinetic
        self.actuator_work += float(_midpoint_means(end_force(made, v, V)) @ np.diff(V_N))
        self.shake_work -= self.dt * float(
            _midpoint_means(base * (w @ masses + W.sum(axis=1))).sum()
        )
        self.heat += self.dt * _midpoint_means(made.eta * w**2).sum(axis=0)
        if made.design.substrate == 'elastic':
            self.substrate_heat += self.dt * _midpoint_means(made.eta * W**2).sum(axis=0)
        else:  # dragged at V_N' shape_j by the actuator, which does this work too
            rates = np.diff(V_N) / self.dt
            dragged = self.dt * made.eta * float(rates @ rates) * made.strain_shape**2
            self.substrate_heat += dragged
            self.actuator_work += float(dragged.sum())

    def books(self) -> Array:
        """Return actuator work, transducer work, all heat and stored energy so far."""
        stored = energy(self).total
        heat = self.heat.sum() + self.substrate_heat.sum()
        return np.array([self.actuator_work, self.transducer_work, heat, stored])


def _midpoint_means(moments: Array) -> Array:
    """Return the means of consecutive moments."""
    return np.asarray(0.5 * (moments[:-1] + moments[1:]))


def fit_meter(element: MemoryElement) -> MeteredChain:
    """Put a metered chain in the place of a new device's own, and return it."""
    meter = MeteredChain(element.design, element.chain.dt, element.chain.integrator)
    element.driver = Simulation(meter)
    element.transducer = Transducer(element.design, element.settings, element.driver)
    return meter
