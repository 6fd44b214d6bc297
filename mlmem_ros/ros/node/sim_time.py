# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pacing by /clock, for `use_sim_time`; it may pause, jump and run at any rate."""

from __future__ import annotations

from threading import Condition

from rclpy.clock import Clock

POLL = 1e-3
"""Seconds of wall time between two checks of the clock."""


class SimTimePacer:
    """Follows the node's clock, which /clock advances, mostly by 1 to 100 ms at a time."""

    slack = 0.5

    def __init__(self, clock: Clock) -> None:
        self._clock = clock

    def now(self) -> float:
        """Return the ROS time in seconds."""
        now: float = self._clock.now().nanoseconds * 1e-9
        return now

    def wait(self, changed: Condition, seconds: float) -> None:
        """Return soon: whether and how fast ROS time runs is unknown."""
        changed.wait(POLL)
