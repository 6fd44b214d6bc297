# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The topics the node subscribes to: commands without an answer."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from functools import partial
from typing import Any

from rclpy.node import Node
from rclpy.serialization import deserialize_message

from ...contract import topics
from ...contract.commands import OF_TOPIC
from ...host import Host
from ..qos import profile
from . import imu

IN_METRES = (topics.STRAIN_TRAJECTORY, topics.JOINT_COMMANDS)


class Subscriptions:
    """Turns messages into commands, and logs refusals; no message does harm."""

    def __init__(self, node: Node, host: Host) -> None:
        self._host = host
        for topic in topics.COMMANDS:
            name = f'~/{topic.name}'
            listener = self._listener(topic, name, node.resolve_topic_name(name))
            node.create_subscription(topic.kind, name, listener, profile(topic.qos), raw=True)

    def _listener(self, topic: topics.Topic, name: str, full: str) -> Callable[[bytes], None]:
        kind, make = topic.kind, OF_TOPIC[topic.name]
        whole = partial(deserialize_message, message_type=kind)
        decode: Callable[[bytes], Any] = imu.decoded if topic is topics.DISTURBANCE else whole
        log = self._host.log

        def listen(cdr: bytes) -> None:
            try:
                message = decode(cdr)
            except Exception as error:  # the bytes are not such a message
                log.refused(name, f'the message must be a {kind.__name__}; {error}')
                return
            with log.guarded(name):
                if (recording := self._host.recording) is not None:
                    recording.put(full, cdr)
                request = self._host.submit_scaled(lambda units: make(message, units))
                request.answer.add_done_callback(answered)

        def answered(answer: Future[Any]) -> None:
            if (refusal := answer.exception()) is not None:
                unit = ''
                if topic in IN_METRES and (element := self._host.element) is not None:
                    unit = f' (a strain of 1 is {element.units.elongation:g} m)'
                log.refused(name, f'{refusal}{unit}')

        return listen
