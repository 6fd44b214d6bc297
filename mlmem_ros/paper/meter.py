# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A chain that keeps the books of its energy, step by step, while a device works on it."""

from __future__ import annotations

import numpy as np

from ..device import MemoryElement
from ..device.transducer import Transducer
from ..physics import NOH_BATHE, Chain, Design, Drive, Integrator, StateError
from ..physics.energy import actuator_force, energy, metamaterial_force
from ..physics.potential import Array

RESTING = 2
"""Steps between two entries of the heat while nothing is driven: six a period at the least."""


class MeteredChain(Chain):
    """A chain with the same bits whose work and heat are summed by the trapezoidal rule.

    Energies are in k_r (lattice constant)^2, times in time units.

    Attributes:
        actuator_work: Work of the actuator so far, F dV_N.
        transducer_work: Work of whatever held an end cell so far: against the springs, the
            damping and the cell's inertia.
        heat: Dissipated by every cell so far, shape (N,); the quasi-static substrate of the
            rigid model dissipates nothing, that of the elastic one counts with its cell.
    """

    def __init__(
        self, design: Design, dt: float | None = None, integrator: Integrator = NOH_BATHE
    ) -> None:
        """Make a blank chain at rest, as `Chain` does."""
        super().__init__(design, dt, integrator)
        self.actuator_work = self.transducer_work = 0.0
        self.heat = np.zeros(design.N)

    def advance(self, V_N: Array, drive: Drive | None = None, shake: Array | None = None) -> Array:
        """Advance by whole steps as `Chain.advance` does.

        Raises:
            StateError: As there, or the base is shaken, whose work is not metered.
        """
        if shake is not None:
            raise StateError('shake must be None: the work of a shaken base is not metered')
        self.check_inputs(V_N, drive)
        substeps = self.integrator.substeps
        ends = np.empty((2, len(V_N) // substeps))
        pull, power = None, self._power()
        resting = drive is None and bool(np.all(V_N == self.V_N))
        for k in range(0, ends.shape[1], stride := RESTING if resting else 1):
            step = slice(substeps * k, substeps * (k + stride))
            before, moving = self.V_N, V_N[substeps * (k + 1) - 1] != self.V_N
            if moving and pull is None:
                pull = actuator_force(self)
            held = None
            if drive is not None and drive.motion[:, step].size:
                held = Drive(drive.site, drive.motion[:, step])
                place, speed, push = self._driven(drive.site)
            ran = ends[:, k : k + stride]
            ran[:] = super().advance(V_N[step], held)
            old_pull, pull = pull, actuator_force(self) if moving else None
            if old_pull is not None and pull is not None:
                self.actuator_work += 0.5 * (old_pull + pull) * (self.V_N - before)
            old_power, power = power, self._power()
            self.heat += 0.5 * (old_power + power) * self.dt * ran.shape[1]
            if held is not None:
                new_place, new_speed, new_push = self._driven(held.site)
                self.transducer_work += 0.5 * (push + new_push) * (new_place - place)
                self.transducer_work += 0.5 * (new_speed**2 - speed**2)  # the inertia, m = 1
        return ends

    def books(self) -> Array:
        """Return actuator work, transducer work, all heat and stored energy so far."""
        stored = energy(self).total
        return np.array([self.actuator_work, self.transducer_work, self.heat.sum(), stored])

    def _power(self) -> Array:
        squares = self.velocity**2 + self.substrate_velocity**2
        return np.asarray(self.specimen.eta * squares)

    def _driven(self, site: int) -> tuple[float, float, float]:
        """Return place and speed of a cell, and the force that holds it against its springs."""
        speed = float(self.velocity[site - 1])
        force = metamaterial_force(self.specimen, self.v, np.asarray(self.V))[site - 1]
        return self.end(site), speed, self.specimen.eta * speed - float(force)


def fit_meter(element: MemoryElement) -> MeteredChain:
    """Put a metered chain in the place of a new device's own, and return it."""
    meter = MeteredChain(element.design, element.chain.dt, element.chain.integrator)
    element.chain = meter
    element.transducer = Transducer(meter, element.transducer.probes)
    return meter
