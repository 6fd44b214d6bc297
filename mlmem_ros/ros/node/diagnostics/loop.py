# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The loop: how it keeps time, and what it refused."""

from __future__ import annotations

import time

from ....device import Loop
from ....device.loop_statistics import LoopStatistics
from ....host import Host
from .health import ERROR, OK, WARN, Component, Health


class LoopComponent(Component):
    """Warns when ticks of wall time are lost."""

    name = 'loop'

    def __init__(self, host: Host) -> None:
        self._host = host
        self._last = (time.monotonic(), 0.0, 0.0)
        self._told = 0

    def health(self, loop: Loop) -> Health:
        """Return how the loop keeps time; all times in seconds."""
        statistics = loop.statistics
        rate, lost = self._since_last(statistics)
        values = {
            'rate': rate,
            'real_time_factor': rate * loop.tick_seconds,
            'ticks': statistics.ticks,
            'overruns': statistics.overruns,
            'lateness_mean': statistics.lateness_mean,
            'lateness_deviation': statistics.lateness_deviation,
            'busy': statistics.busy,
            'procedure': loop.element.procedure,
            'refused': self._host.refused,
            'defects': self._host.journal.caught,
        }
        if loop.failure:
            return Health(ERROR, str(loop.failure), values)
        if lost > 0:
            text = f'{statistics.overruns} ticks of time were skipped'
            if statistics.overruns >= 2 * self._told:  # each time it has doubled, not every second
                self._told = statistics.overruns
                self._host.journal.warning(f'{text}: the machine is too slow for this pace')
            return Health(WARN, text, values)
        return Health(OK, 'paused' if loop.paused else 'running', values)

    def rest(self) -> Health:
        """Count on: an inactive node refuses all that is asked of it."""
        self._told = 0
        return Health(OK, 'inactive', {'refused': self._host.refused})

    def _since_last(self, statistics: LoopStatistics) -> tuple[float, int]:
        """Return ticks per second and new overruns since the last report."""
        present = (time.monotonic(), statistics.ticks, statistics.overruns)
        seconds, ticks, overruns = (a - b for a, b in zip(present, self._last, strict=True))
        self._last = present
        return max(0.0, ticks) / max(seconds, 1e-9), round(overruns)
