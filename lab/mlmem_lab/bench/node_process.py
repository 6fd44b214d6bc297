# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The node under test in its own process, and a robot that uses it in this one."""

from __future__ import annotations

import json
import os
import random
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from .measure import Load

if TYPE_CHECKING:
    from mlmem_ros.ros.client.client import MemoryClient


IMU_RATE = 200.0
"""Messages per second from a base that shakes."""


class NodeProcess:
    """A `node_probe` of one node or several, for the duration of a `with`.

    Attributes:
        ready: Seconds from the start of the process until it was ready.
        others: Share of a core that others took meanwhile, in percent.
    """

    def __init__(self, number: int = 1, **environment: str) -> None:
        probe = f'{__package__}.node_probe'
        command = [sys.executable, '-m', probe, str(time.time()), str(number)]
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
            stderr=subprocess.DEVNULL, env=os.environ | environment,
        )  # fmt: skip
        load = self.load()
        self.ready: float = self._report()['ready']
        self.others = load.others()

    def __enter__(self) -> NodeProcess:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.__exit__(None, None, None)  # closes its input, and waits for its end

    def load(self) -> Load:
        """Begin to measure what others than this process and the node take of the machine."""
        return Load([self._process.pid])

    def watch(
        self,
        seconds: float,
        meanwhile: Callable[[float], object] = lambda seconds: None,
        speed: float = 1.0,
    ) -> dict[str, float]:
        """Let it watch itself for some seconds, and return what it measured.

        `others` is the share of a core that others took meanwhile.

        Args:
            meanwhile: Called with this time; what the robot does to the node.
        """
        assert self._process.stdin is not None
        load = self.load()
        self._process.stdin.write(f'{seconds} {speed}\n')
        self._process.stdin.flush()
        meanwhile(seconds)
        return {**self._report(), 'others': load.others()}

    def _report(self) -> dict[str, float]:
        assert self._process.stdout is not None
        while line := self._process.stdout.readline():
            if line.startswith('{'):
                values: dict[str, float] = json.loads(line)
                return values
        raise RuntimeError('the node ended before it reported anything')


def measure_overhead_ms(ask: Callable[[], Any]) -> float:
    """Make a request; return the milliseconds it took beyond the ticks of its physics.

    Args:
        ask: Sends it and returns its `Reply`. One that the node refuses takes no ticks.
    """
    from mlmem_ros.contract.calls import RequestRefused

    time.sleep(random.uniform(0.02, 0.06))  # at a random time within a tick
    ticks, begun = 0.0, time.monotonic()
    with suppress(RequestRefused):
        ticks = ask().wait().details['ticks']
    tick_ms = 2.0  # milliseconds of a tick at the defaults
    return 1e3 * (time.monotonic() - begun) - tick_ms * ticks


def write(memory: MemoryClient, seconds: float) -> None:
    """Write one level after another for some seconds."""
    end, level = time.monotonic() + seconds, 0
    while time.monotonic() < end:
        level = (level + 3) % 8
        memory.request('write', level=level).wait()


def watch_streams(node: NodeProcess, seconds: float, shaken: bool) -> dict[str, float]:
    """Subscribe to a node's streams, and return what it measures meanwhile.

    An IMU shakes the element if asked for.
    """
    from rclpy.qos import qos_profile_sensor_data
    from sensor_msgs.msg import JointState
    from std_msgs.msg import Float32MultiArray, Float64MultiArray

    from mlmem_ros.ros.client.client import standalone

    streams = {'joint_states': JointState, 'field': Float32MultiArray, 'wall': Float64MultiArray}
    with standalone() as memory:
        robot = memory.node
        for name, kind in streams.items():
            topic = f'{memory.name}/{name}'
            robot.create_subscription(kind, topic, lambda _: None, qos_profile_sensor_data)
        if shaken:
            _start_shaking(memory)
        time.sleep(1.0)  # they discover each other
        return node.watch(seconds, time.sleep)


def _start_shaking(memory: MemoryClient) -> None:
    """Send the accelerations of a base that shakes, as long as the client's node lives."""
    from sensor_msgs.msg import Imu

    base = memory.node.create_publisher(Imu, f'{memory.name}/disturbance', 10)

    shake_acceleration = 0.01  # its acceleration in m/s^2

    def publish_acceleration() -> None:
        message = Imu()
        message.linear_acceleration.x = random.uniform(-shake_acceleration, shake_acceleration)
        base.publish(message)

    memory.node.create_timer(1.0 / IMU_RATE, publish_acceleration)
