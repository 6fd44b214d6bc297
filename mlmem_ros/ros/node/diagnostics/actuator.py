# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The actuator: where the strain is, and where it goes."""

from __future__ import annotations

from typing import Any

from ....device import Loop, MemoryElement
from ....physics.energy import actuator_force
from .health import OK, Component, Health


class ActuatorComponent(Component):
    """Tells strain, target and force."""

    name = 'actuator'

    def __init__(self) -> None:
        self._values: dict[str, Any] = {}
        self._text = 'at rest'

    def after_tick(self, element: MemoryElement) -> None:
        """Take strain and force; the force in k_r cells."""
        actuator = element.actuator
        self._text = 'moving' if actuator.moving else 'holding' if actuator.strain else 'at rest'
        self._values = {
            'strain': actuator.strain,
            'target': actuator.motion.target,
            'max_strain': actuator.settings.max_strain,
            'force': actuator_force(element.chain),
        }

    def health(self, loop: Loop) -> Health:
        """Return what was taken."""
        return Health(OK, self._text, self._values)
