# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pacing by /clock, for `use_sim_time`: it pauses, jumps and runs at any rate."""

from __future__ import annotations

from threading import Condition

from rclpy.clock import Clock

POLL = 1e-3
"""Seconds of wall time between two checks of the clock."""


class SimTimePacer:
    """ROS time as the node's clock follows it on /clock, in steps of 1 to 100 ms as a rule."""

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
