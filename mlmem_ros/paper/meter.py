# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A chain that keeps the books of its energy, step by step, while a device works on it."""

from __future__ import annotations

import numpy as np

from ..device import MemoryElement
from ..device.simulation import Simulation
from ..device.transducer import Transducer
from ..physics import NOH_BATHE, Chain, Design, Drive, Integrator
from ..physics.energy import energy
from ..physics.potential import Array
from .books import audited


class MeteredChain(Chain):
    """A chain with the same bits whose budgets are summed.

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

    def advance(
        self,
        V_N: Array,
        drive: Drive | None = None,
        shake: Array | None = None,
        looks: int = 1,
    ) -> Array:
        """Advance by whole steps as `Chain.advance` does; it looks at its cells after each."""
        self.check_inputs(V_N, drive, shake)
        base = np.zeros_like(V_N) if shake is None else shake
        ends, budget = audited(self, super().advance, V_N, drive, base)
        self.actuator_work += budget.actuator
        self.transducer_work += budget.held
        self.heat += budget.damped
        return ends

    def books(self) -> Array:
        """Return actuator work, transducer work, all heat and stored energy so far."""
        stored = energy(self).total
        return np.array([self.actuator_work, self.transducer_work, self.heat.sum(), stored])


def fit_meter(element: MemoryElement) -> MeteredChain:
    """Put a metered chain in the place of a new device's own, and return it."""
    meter = MeteredChain(element.design, element.chain.dt, element.chain.integrator)
    element.driver = Simulation(meter)
    element.transducer = Transducer(element.design, element.settings, element.driver)
    return meter
