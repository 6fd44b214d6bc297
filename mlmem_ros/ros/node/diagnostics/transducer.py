# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The transducer: how quiet the ends are, and how loud the last echo was."""

from __future__ import annotations

from typing import Any

from ....device import Loop, MemoryElement
from ....device.end import End
from .health import OK, WARN, Component, Health

WEAK = 1.5
"""Threshold margin below which an echo may soon be missed; those of the paper's element are above
2."""


class TransducerComponent(Component):
    """Warns when a level was decoded from a weak echo."""

    name = 'transducer'

    def __init__(self) -> None:
        self._values: dict[str, Any] = {}
        self._text = 'listening'

    def after_tick(self, element: MemoryElement) -> None:
        """Take what the ends do, in cells, and the delays they are judged by, in time units."""
        transducer = element.transducer
        self._text = 'driving' if transducer.driving else 'listening'
        self._values = {f'unrest_{end}': transducer.unrest(end) for end in End}
        for end in element.calibration.ends:
            delays = element.calibration.table(end).delays
            self._values[f'delays_{end}'] = ' '.join(f'{delay:g}' for delay in delays)

    def health(self, loop: Loop) -> Health:
        """Return what was taken, and the margin of the last echo."""
        reading = loop.element.reading
        if reading is None:
            return Health(OK, self._text, self._values)
        margin = reading.threshold_margin
        values = {**self._values, 'end': reading.end, 'threshold_margin': margin}
        if reading.level >= 0 and margin < WEAK:
            return Health(WARN, f'a weak echo: {margin:.3g} times the threshold', values)
        return Health(OK, self._text, values)
