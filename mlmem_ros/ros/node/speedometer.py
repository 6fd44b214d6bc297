# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Logs how fast the material's time ran compared with wall time."""

from __future__ import annotations

import time

from rclpy.node import Node

from ...device import Loop
from ...host import Host
from .boundary import Boundary

INTERVAL = 10.0
"""Seconds between two reports while time runs as fast as possible."""


class Speedometer:
    """Logs the multiple of real time: for every run, and periodically for one without pace."""

    def __init__(self, node: Node, host: Host, boundary: Boundary) -> None:
        self._node = node
        self._host = host
        self._begun = self._last = (0.0, 0)
        boundary.every(INTERVAL, 'the speedometer', self._report)

    def begin(self, loop: Loop) -> None:
        """Start a run now."""
        self._begun = self._last = (time.monotonic(), loop.statistics.ticks)

    def end(self, loop: Loop) -> None:
        """Report a run that ends now."""
        self._log(loop, self._begun)

    def _report(self) -> None:
        loop = self._host.loop
        if loop is not None and loop.speed == 0.0 and not loop.paused:
            self._last = self._log(loop, self._last)

    def _log(self, loop: Loop, since: tuple[float, int]) -> tuple[float, int]:
        now, ticks = time.monotonic(), loop.statistics.ticks
        seconds = max(now - since[0], 1e-9)
        factor = (ticks - since[1]) * loop.tick_seconds / seconds
        self._node.get_logger().info(
            f'{ticks - since[1]} ticks in {seconds:.1f} s: {factor:.3g} times real time'
        )
        return now, ticks
