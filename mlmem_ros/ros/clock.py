# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The executable `memory_clock`, which publishes /clock for nodes with `use_sim_time` where no
simulator does.
"""

from __future__ import annotations

import sys
from contextlib import suppress

import rclpy
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor
from rclpy.clock import Clock, ClockType
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rosgraph_msgs.msg import Clock as ClockMessage

from .middleware import RELIABLE_PROFILE

SPEED_PARAMETER = 'time.speed'

PERIOD_S = 2e-3
"""Wall time between two messages in seconds."""

MIN_SPEED, MAX_SPEED = 1e-3, 100.0
"""Multiples of real time. The highest makes steps of 0.2 s: a memory node treats one of more than
0.5 s as a jump.
"""


class ClockNode(Node):
    """Publishes /clock from 0 s on, at `time.speed` times real time.

    Every message advances it by the same step. On a machine that is too slow, simulated time is
    late, but does not jump. The speed may be set at any time.
    """

    def __init__(self, name: str = 'memory_clock') -> None:
        """Start the clock.

        Raises:
            InvalidParameterValueException: The speed is out of range.
        """
        super().__init__(name)
        self.declare_parameter(
            SPEED_PARAMETER,
            1.0,
            ParameterDescriptor(
                description='multiple of real time',
                floating_point_range=[
                    FloatingPointRange(from_value=MIN_SPEED, to_value=MAX_SPEED)
                ],
            ),
        )
        self._now_s = 0.0
        self._publisher = self.create_publisher(ClockMessage, '/clock', RELIABLE_PROFILE)
        # the node's own clock may be the one that it publishes
        self.create_timer(
            PERIOD_S, self._advance_clock, clock=Clock(clock_type=ClockType.STEADY_TIME)
        )

    def _advance_clock(self) -> None:
        self._now_s += self.get_parameter(SPEED_PARAMETER).value * PERIOD_S
        message = ClockMessage()
        message.clock.sec, message.clock.nanosec = divmod(round(1e9 * self._now_s), 10**9)
        self._publisher.publish(message)


def main() -> int:
    """Publish /clock until SIGINT or SIGTERM; return the exit status."""
    rclpy.init()
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(ClockNode())
    rclpy.try_shutdown()
    return 0


if __name__ == '__main__':
    sys.exit(main())
