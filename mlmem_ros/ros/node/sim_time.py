# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pacing by /clock, for `use_sim_time`; it may pause, jump and run at any rate."""

from __future__ import annotations

from threading import Condition

from rclpy.clock import Clock, JumpThreshold, TimeJump
from rclpy.duration import Duration

POLL = 1e-3
"""Seconds of wall time between two checks of the clock."""


class SimTimePacer:
    """Follows the node's clock, which /clock advances, mostly by 1 to 100 ms at a time.

    A message that advances it by more than the slack, or sets it back by as much, is a jump: a
    simulator was reset, or started late. No time passes in it, and none is lost.
    """

    slack = 0.5

    def __init__(self, clock: Clock) -> None:
        """Follow a clock, as long as it exists."""
        self.jumps = 0
        self._clock = clock
        self._latest = 0.0
        self._before = 0  # nanoseconds jumped over in all
        self._jumped: int | None = 0  # the same, or None while the clock is set
        slack = Duration(seconds=self.slack)
        back = Duration(seconds=-self.slack)
        self._handle = clock.create_jump_callback(  # valid as long as we refer to it
            JumpThreshold(min_forward=slack, min_backward=back, on_clock_change=False),
            pre_callback=self._before_jump,
            post_callback=self._after_jump,
        )

    def now(self) -> float:
        """Return the ROS time in seconds, without its jumps."""
        jumped = self._jumped
        now = self._clock.now().nanoseconds
        if jumped is not None and jumped == self._jumped:  # it is not being set meanwhile
            self._latest = (now - jumped) * 1e-9
        return self._latest

    def wait(self, changed: Condition, seconds: float) -> None:
        """Return soon: whether and how fast ROS time runs is unknown."""
        changed.wait(POLL)

    def _before_jump(self) -> None:
        self._before, self._jumped = self._jumped or 0, None

    def _after_jump(self, jump: TimeJump) -> None:
        self.jumps += 1
        self._jumped = self._before + jump.delta.nanoseconds
