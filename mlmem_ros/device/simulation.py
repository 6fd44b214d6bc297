# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The driver of a simulated element."""

from __future__ import annotations

import math

from ..physics import INTEGRATORS, Chain, Design, HeldCell, Specimen, default_step
from ..physics.energy import actuator_force
from ..physics.equilibrium import blank
from ..physics.potential import Array
from .driver import Driver
from .errors import SettingsError
from .settings import TimeSettings

MOST_WORK = 10**8
"""Most cell steps of a tick, with at least a thousand cells: about a quarter of a second."""


def steps_per_tick(made: Design | Specimen, time: TimeSettings) -> int:
    """Return the least number of steps of a tick that is accurate and stable.

    Raises:
        SettingsError: The tick needs more than `MOST_WORK`.
    """
    made = Specimen.of(made)
    dt = default_step(made, INTEGRATORS[time.integrator])
    steps, most = math.ceil(time.tick / dt), MOST_WORK // max(made.design.N, 1000)
    if steps > most:
        raise SettingsError(
            f'time.tick must be at most {most * dt:.4g}, which is {most} steps of this design; '
            f'got {time.tick:g}'
        )
    return steps


class Simulation(Driver):
    """A chain in place of a real element; each step is a sample."""

    chain: Chain

    def __init__(self, chain: Chain) -> None:
        self.chain = chain
        self.dt = chain.dt
        self.nodes = chain.integrator.nodes

    @classmethod
    def of(cls, made: Design | Specimen, time: TimeSettings, finer: int = 1) -> Simulation:
        """Return the driver of a blank element at rest, exactly as designed if a design is given.

        Args:
            made: The element.
            time: Tick and integrator.
            finer: By how much its steps are shorter than they need to be.

        Raises:
            SettingsError: A tick needs too many steps.
            DesignError: The step is beyond the stability limit.
            StateError: Its ground states are scattered so much that nothing rests in them.
        """
        dt = time.tick / (finer * steps_per_tick(made, time))
        integrator = INTEGRATORS[time.integrator]
        if isinstance(made, Design):
            return cls(Chain(made, dt, integrator))
        chain = Chain(made.design, dt, integrator)
        chain.set_specimen(made)
        chain.place(blank(made))
        return cls(chain)

    @property
    def V_N(self) -> float:  # type: ignore[override]
        """Displacement of the substrate's end."""
        return self.chain.V_N

    def advance(
        self,
        V_N: Array,
        held_cell: HeldCell | None = None,
        shake: Array | None = None,
        looks: int = 1,
    ) -> Array:
        """Advance the chain; see `Chain.advance`."""
        return self.chain.advance(V_N, held_cell, shake, looks)

    def at_rest(self, V_N: float) -> bool:
        """Return whether the chain is at rest at a displacement of the substrate's end."""
        return V_N == self.chain.V_N and self.chain.at_rest

    def pass_by(self, steps: int) -> None:
        """Let the clock of the chain go on."""
        self.chain.pass_by(steps)

    def end(self, site: int) -> float:
        """Return the displacement of an end."""
        return self.chain.end(site)

    def force(self) -> float:
        """Return the force of the actuator."""
        return actuator_force(self.chain)
