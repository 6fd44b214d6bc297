# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A behaviour node that keeps the number of its gait in a mechanical memory, and nowhere else.

    ~/set_gait   std_msgs/UInt8              change to this gait once the memory holds it
    ~/gait       std_msgs/UInt8, latched     the present gait
    ~/pressures  std_msgs/Float32MultiArray  pressure of every leg, from 0 to 1

At its start it reads the element and continues in the stored gait. Run it beside a memory node:
ros2 run gait_store gait_node --ros-args -p memory:=/mlmem
"""

from __future__ import annotations

import signal
import sys
from collections.abc import Sequence
from typing import Any

import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future
from std_msgs.msg import Float32MultiArray, UInt8

from mlmem_ros import MemoryClient, NoAnswer, RequestError, RequestRefused
from mlmem_ros.contract.topics import Qos

from .gaits import GAITS

PRESSURE_PERIOD_S = 0.02
"""Seconds between two sets of pressures."""

MAX_READ_ATTEMPTS = 60
"""Reads at the start, one a second, before a busy memory is given up."""

REST_GAIT = 0
"""The gait of a robot whose memory is blank."""


class GaitNode(Node):
    """Walks in the gait that the memory holds, and rests until it knows that."""

    def __init__(self, **options: Any) -> None:
        """Begin to rest.

        Args:
            options: For `rclpy.node.Node`.
        """
        super().__init__('gait', **options)
        memory = self.declare_parameter('memory', 'mlmem').value
        self._memory = MemoryClient(self, memory, patience=30.0)
        self._gait = REST_GAIT
        self._publisher = self.create_publisher(UInt8, '~/gait', Qos.LATCHED.profile)
        self._pressures = self.create_publisher(
            Float32MultiArray, '~/pressures', Qos.SENSOR_DATA.profile
        )
        # A callback that awaits blocks its callback group, but the legs must go on.
        self.create_subscription(
            UInt8,
            '~/set_gait',
            self._on_set_gait,
            Qos.RELIABLE.profile,
            callback_group=self._memory.group,
        )
        self.create_timer(PRESSURE_PERIOD_S, self._on_timer)

    async def recall_gait(self) -> None:
        """Take up the gait that the element holds.

        Raises:
            RequestError: The memory does not answer, or cannot be read.
        """
        for _ in range(MAX_READ_ATTEMPTS):
            try:
                content = await self._memory.read(timeout=30.0)
            except RequestRefused as busy:  # with a write from before our restart
                self.get_logger().info(f'waiting for the memory: {busy}')
                await self._wait_seconds(1.0)
            else:
                self._take_up_gait(REST_GAIT if content.blank else content.level)
                return
        raise NoAnswer(f'the memory was busy for {MAX_READ_ATTEMPTS} s')

    async def _wait_seconds(self, seconds: float) -> None:
        over = Future()
        clock = Clock(clock_type=ClockType.STEADY_TIME)
        timer = self.create_timer(seconds, lambda: over.set_result(None), clock=clock)
        await over
        self.destroy_timer(timer)

    async def _on_set_gait(self, message: UInt8) -> None:
        """Write first, then walk: after a crash in between, the robot takes up the stored gait."""
        if message.data >= len(GAITS):
            self.get_logger().error(f'gait must be from 0 to {len(GAITS) - 1}; got {message.data}')
            return
        try:
            written = await self._memory.write(message.data)
        except RequestError as error:
            self.get_logger().error(f'still in gait {self._gait}: {error}')
        else:
            self._take_up_gait(written.level)

    def _take_up_gait(self, gait: int) -> None:
        self._gait = gait
        self._publisher.publish(UInt8(data=gait))
        self.get_logger().info(f'gait {gait}: {GAITS[gait].name}')

    def _on_timer(self) -> None:
        now = self.get_clock().now().nanoseconds / 1e9
        self._pressures.publish(Float32MultiArray(data=GAITS[self._gait].compute_pressures(now)))


def main(arguments: Sequence[str] | None = None) -> int:
    """Walk until SIGINT or SIGTERM; return the exit status.

    rclpy's signal handlers would shut ROS down at once, and an exception from a handler may be
    raised anywhere. Ours only note the signal, and nothing cuts the end short, though a terminal
    and launch send a SIGINT each.
    """
    received: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda number, _: received.append(number))
    rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
    node, executor, status = GaitNode(), SingleThreadedExecutor(), 0
    executor.add_node(node)
    executor.create_task(node.recall_gait)
    try:
        while not received:
            executor.spin_once(timeout_sec=0.1)
    except RequestError as error:
        print(f'the gait is not known: {error}', file=sys.stderr)
        status = 1
    for number in (signal.SIGINT, signal.SIGTERM):  # Python takes its handlers away at the end
        signal.signal(number, signal.SIG_IGN)
    executor.shutdown()
    node.destroy_node()  # leave the graph, or others keep sending for 20 s
    rclpy.try_shutdown()  # shutdown() sets the default handlers for a moment
    return status


if __name__ == '__main__':
    sys.exit(main())
