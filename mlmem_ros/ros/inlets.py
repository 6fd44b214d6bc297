# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The topics the node listens to: commands without an answer."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

from rclpy.node import Node
from rclpy.serialization import serialize_message
from std_msgs.msg import Empty, Float64, UInt8

from ..device import Command, Read, SetStrain, Write
from .gate import Gate
from .outlets import Tap
from .qos import RELIABLE


class Inlets:
    """Turns command messages into commands; a refusal is logged.

    Attributes:
        tap: Called with every message that comes in, or None.
    """

    TOPICS: tuple[tuple[str, type[Any], Callable[[Any], Command]], ...] = (
        ('~/strain', Float64, lambda message: SetStrain(message.data)),
        ('~/probe', Empty, lambda _: Read()),
        ('~/write_level', UInt8, lambda message: Write(message.data)),
    )

    def __init__(self, node: Node, gate: Gate) -> None:
        self.tap: Tap | None = None
        self._node = node
        self._gate = gate
        for topic, kind, command in self.TOPICS:
            node.create_subscription(kind, topic, self._listener(topic, command), RELIABLE)

    def _listener(self, topic: str, command: Callable[[Any], Command]) -> Callable[[Any], None]:
        name = self._node.resolve_topic_name(topic)

        def listen(message: Any) -> None:
            if self.tap is not None:
                self.tap(name, serialize_message(message))
            answer = self._gate.submit(command(message))
            answer.add_done_callback(lambda done: self._log_refusal(topic, done))

        return listen

    def _log_refusal(self, topic: str, answer: Future[Any]) -> None:
        if (refusal := answer.exception()) is not None:
            self._node.get_logger().warning(f'{topic} refused: {refusal}')
