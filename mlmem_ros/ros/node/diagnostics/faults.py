# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The faults that were set: a simulated device says that it is not healthy."""

from __future__ import annotations

from ....device import Loop
from .health import OK, WARN, Component, Health


class FaultsComponent(Component):
    """Warns while a fault is set."""

    name = 'faults'

    def health(self, loop: Loop) -> Health:
        """Return what is wrong, by parameter."""
        if found := loop.element.faults.active():
            return Health(WARN, f'set: {", ".join(found)}', found)
        return Health(OK, 'healthy')
