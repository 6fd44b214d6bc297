# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The node under test in its own process, and its client in this one."""

from __future__ import annotations

import json
import os
import random
import subprocess
import sys
import time
from typing import Any

TICK = 2.0
"""Milliseconds of a tick at the defaults."""

IMU_RATE = 200.0
"""Messages a second of a base that shakes."""

SHAKE = 0.01
"""Its acceleration in m/s^2."""


class NodeProcess:
    """A `node_probe` that runs within a `with`, of one node or several.

    Attributes:
        ready: Seconds it took from the start of its process.
    """

    def __init__(self, number: int = 1, **environment: str) -> None:
        probe = f'{__package__}.node_probe'
        command = [sys.executable, '-m', probe, str(time.time()), str(number)]
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
            stderr=subprocess.DEVNULL, env=os.environ | environment,
        )  # fmt: skip
        self.ready: float = self.told()['ready']

    def __enter__(self) -> NodeProcess:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.__exit__(None, None, None)  # closes its input, and waits for its end

    def ask(self, seconds: float) -> None:
        """Make it watch itself; `told` returns the result."""
        assert self._process.stdin is not None
        self._process.stdin.write(f'{seconds}\n')
        self._process.stdin.flush()

    def told(self) -> dict[str, float]:
        """Wait for its report."""
        assert self._process.stdout is not None
        while line := self._process.stdout.readline():
            if line.startswith('{'):
                values: dict[str, float] = json.loads(line)
                return values
        raise RuntimeError('the node ended before it reported anything')

    def watch(self, seconds: float) -> dict[str, float]:
        """Make it watch itself, and return the result."""
        self.ask(seconds)
        return self.told()


class Robot:
    """The reader and subscriber, in this process, on its own ROS graph."""

    def __init__(self) -> None:
        os.environ['ROS_DOMAIN_ID'] = str(random.randint(1, 100))
        os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
        import rclpy
        from rcl_interfaces.srv import SetParametersAtomically
        from sensor_msgs.msg import Imu
        from std_srvs.srv import Trigger

        from ..ros.events import events_executor

        rclpy.init()
        self._node = rclpy.create_node('robot', start_parameter_services=False)
        self._executor = events_executor()
        self._executor.add_node(self._node)
        self._request = Trigger.Request
        self._clients = {
            name: self._node.create_client(Trigger, f'/mlmem/{name}') for name in ('read', 'step')
        }
        self._request_client = self._node.create_client(SetParametersAtomically, '/mlmem/request')
        self._base = self._node.create_publisher(Imu, '/mlmem/disturbance', 10)

    def close(self) -> None:
        """Leave the graph."""
        import rclpy

        rclpy.shutdown()

    def beyond(self, service: str) -> float:
        """Call a service; return the milliseconds it took beyond the ticks of its physics."""
        client = self._clients[service]
        assert client.wait_for_service(10.0)
        time.sleep(random.uniform(0.02, 0.06))  # at a random time within a tick
        begun = time.monotonic()
        future = client.call_async(self._request())
        self._executor.spin_until_future_complete(future, timeout_sec=20.0)
        taken = 1e3 * (time.monotonic() - begun)
        return taken - TICK * float(json.loads(future.result().message).get('ticks', 0))

    def write(self, node: NodeProcess, seconds: float) -> dict[str, float]:
        """Write one level after another while a node watches itself; return its result."""
        from ..contract.requests import message_of

        assert self._request_client.wait_for_service(10.0)
        node.ask(seconds)
        end, level = time.monotonic() + seconds, 0
        while time.monotonic() < end:
            level = (level + 3) % 8
            future = self._request_client.call_async(message_of('write', level=level))
            self._executor.spin_until_future_complete(future, timeout_sec=20.0)
        return node.told()

    def listen(self, node: NodeProcess, seconds: float, shaken: bool = False) -> dict[str, float]:
        """Subscribe to the streams, with a shaking base or not, while a node watches itself."""
        from rclpy.qos import qos_profile_sensor_data
        from sensor_msgs.msg import JointState
        from std_msgs.msg import Float32MultiArray, Float64MultiArray

        streams: dict[str, type[Any]] = {
            'joint_states': JointState, 'field': Float32MultiArray, 'wall': Float64MultiArray,
        }  # fmt: skip
        subscriptions = [
            self._node.create_subscription(
                kind, f'/mlmem/{name}', lambda _: None, qos_profile_sensor_data
            )
            for name, kind in streams.items()
        ]
        self._turn(1.0)  # the node discovers them
        node.ask(seconds)
        shaking = self._node.create_timer(1.0 / IMU_RATE, self._shake) if shaken else None
        self._turn(seconds)
        if shaking is not None:
            self._node.destroy_timer(shaking)
        for subscription in subscriptions:
            self._node.destroy_subscription(subscription)
        return node.told()

    def _shake(self) -> None:
        from sensor_msgs.msg import Imu

        message = Imu()
        message.linear_acceleration.x = random.uniform(-SHAKE, SHAKE)
        self._base.publish(message)

    def _turn(self, seconds: float) -> None:
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0.0:
            self._executor.spin_once(timeout_sec=left)
