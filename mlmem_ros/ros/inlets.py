# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The topics the node listens to: commands without an answer."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

from rclpy.node import Node
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import Imu
from std_msgs.msg import Empty, Float64, UInt8
from trajectory_msgs.msg import JointTrajectory

from ..bag.command_topics import COMMAND_TOPICS
from ..host import Host
from .outlets import Topic
from .qos import RELIABLE, SENSOR_DATA


class Inlets:
    """Turns command messages into commands; a refusal is logged, and no message does harm."""

    TOPICS: tuple[Topic, ...] = (
        ('~/strain', Float64, RELIABLE),
        ('~/strain_trajectory', JointTrajectory, RELIABLE),
        ('~/probe', Empty, RELIABLE),
        ('~/write_level', UInt8, RELIABLE),
        ('~/disturbance', Imu, SENSOR_DATA),  # which hears reliable publishers, too
    )

    def __init__(self, node: Node, host: Host) -> None:
        self._host = host
        for topic, kind, qos in self.TOPICS:
            listener = self._listener(topic, node.resolve_topic_name(topic), kind)
            node.create_subscription(kind, topic, listener, qos, raw=True)

    def _listener(self, topic: str, name: str, kind: type[Any]) -> Callable[[bytes], None]:
        _, make = COMMAND_TOPICS[topic.removeprefix('~/')]
        journal = self._host.journal

        def listen(cdr: bytes) -> None:
            try:
                message = deserialize_message(cdr, kind)
            except Exception as error:  # the middleware's, of bytes that are no such message
                journal.refused(topic, f'the message must be a {kind.__name__}; {error}')
                return
            with journal.guarded(topic):
                if (recording := self._host.recording) is not None:
                    recording.put(name, cdr)
                answer = self._host.submit_scaled(lambda units: make(message, units))
                answer.add_done_callback(told)

        def told(answer: Future[Any]) -> None:
            if (refusal := answer.exception()) is not None:
                element = self._host.element
                scaled = kind is JointTrajectory and element is not None
                unit = f' (a strain of 1 is {element.units.elongation:g} m)' if scaled else ''
                journal.refused(topic, f'{refusal}{unit}')

        return listen
