# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The content, as the last echo told it, and what the element has been through."""

from __future__ import annotations

from typing import Any

from ....device import UNDECODABLE, Loop, MemoryElement, describe_level
from .health import OK, WARN, Component, Health


class MemoryComponent(Component):
    """Warns when the last echo could not be decoded."""

    name = 'memory'

    def __init__(self) -> None:
        self._wear: dict[str, Any] = {}

    def after_tick(self, element: MemoryElement) -> None:
        """Take the counts."""
        self._wear = element.statistics.as_dict()

    def health(self, loop: Loop) -> Health:
        """Return the last decode with its margins, and the counts."""
        reading = loop.element.reading
        if reading is None:
            return Health(OK, 'not read yet', self._wear)
        values = {
            'level': reading.level,
            'end': reading.end,
            'delay': 'none' if reading.delay is None else reading.delay,
            'level_margin': reading.level_margin,
            'threshold_margin': reading.threshold_margin,
            'confidence': reading.confidence,
            **self._wear,
        }
        if reading.level == UNDECODABLE:
            return Health(WARN, reading.reason, values)
        return Health(OK, describe_level(reading.level), values)
