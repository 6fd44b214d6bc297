# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Elements as sensors show them whose gain is off; each moves its end by what it measures."""

from __future__ import annotations

from dataclasses import replace

from mlmem_ros.device import Driver
from mlmem_ros.device.simulation import Simulation
from mlmem_ros.physics import HeldCell
from mlmem_ros.physics.potential import Array
from mlmem_tools.rig.sensors import Sensors

from ..rk4 import Rk4Element


class Sensed(Driver):
    """Puts sensors between a driver and its user: mixed in before the driver.

    Attributes:
        sensors: They may be exchanged at any time.
    """

    sensors = Sensors()

    def advance(
        self,
        V_N: Array,
        held_cell: HeldCell | None = None,
        shake: Array | None = None,
        looks: int = 1,
    ) -> Array:
        """Return the samples of both ends as the sensors give them; see `Driver.advance`."""
        if held_cell is not None:
            motion = self.sensors.held(held_cell.site, held_cell.motion)
            held_cell = replace(held_cell, motion=motion)
        return self.sensors.readings(super().advance(V_N, held_cell, shake, looks))  # type: ignore[safe-super]

    def end(self, site: int) -> float:
        """Return the displacement of an end as its sensor gives it."""
        gain = self.sensors.gain[int(site > 1)]
        return gain * super().end(site)  # type: ignore[safe-super]


class SensedSimulation(Sensed, Simulation):
    """The package's own simulation, with sensors."""


class SensedElement(Sensed, Rk4Element):
    """An element that is simulated otherwise, with sensors."""
