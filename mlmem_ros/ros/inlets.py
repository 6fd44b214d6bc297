# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The topics the node listens to: commands without an answer."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message
from sensor_msgs.msg import Imu
from std_msgs.msg import Empty, Float64, UInt8
from trajectory_msgs.msg import JointTrajectory

from ..bag.command_topics import COMMAND_TOPICS
from .gate import Gate
from .outlets import Tap, Topic
from .qos import RELIABLE, SENSOR_DATA

QUIET = 1.0
"""Seconds between two lines in the log about a stream."""


class Inlets:
    """Turns command messages into commands; a refusal is logged.

    Attributes:
        tap: Called with every message that comes in, or None.
    """

    TOPICS: tuple[Topic, ...] = (
        ('~/strain', Float64, RELIABLE),
        ('~/strain_trajectory', JointTrajectory, RELIABLE),
        ('~/probe', Empty, RELIABLE),
        ('~/write_level', UInt8, RELIABLE),
        ('~/disturbance', Imu, SENSOR_DATA),  # which hears reliable publishers, too
    )

    def __init__(self, node: Node, gate: Gate) -> None:
        self.tap: Tap | None = None
        self._node = node
        self._gate = gate
        for topic, kind, qos in self.TOPICS:
            node.create_subscription(kind, topic, self._listener(topic, qos), qos)

    def _listener(self, topic: str, qos: QoSProfile) -> Callable[[Any], None]:
        name = self._node.resolve_topic_name(topic)
        _, make = COMMAND_TOPICS[topic.removeprefix('~/')]
        log = self._log_now_and_then if qos is SENSOR_DATA else self._log_refusal

        def listen(message: Any) -> None:
            if self.tap is not None:
                self.tap(name, serialize_message(message))
            answer = self._gate.submit_scaled(lambda scale: make(message, scale))
            answer.add_done_callback(lambda done: log(topic, done))

        return listen

    def _log_now_and_then(self, topic: str, answer: Future[Any]) -> None:
        """Log refusals of a stream: a hundred a second say no more than one."""
        if (refusal := answer.exception()) is not None:
            self._node.get_logger().warning(
                f'{topic} refused: {refusal}', throttle_duration_sec=QUIET
            )

    def _log_refusal(self, topic: str, answer: Future[Any]) -> None:
        if (refusal := answer.exception()) is not None:
            self._node.get_logger().warning(f'{topic} refused: {refusal}')
