# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a node publishes, as it arrives: an ordinary subscriber of its public topics."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

from ..contract import topics
from ..contract.goals import action_types
from ..ros.qos import RELIABLE, SENSOR_DATA, profile

if TYPE_CHECKING:
    from ..ros.client import MemoryClient

PARAMETERS = topics.Topic(
    '/parameter_events',
    'rcl_interfaces/msg/ParameterEvent',
    topics.EVERY_ONE,
    'parameters that were set',
)
ALWAYS = (topics.LEVEL, topics.OUTCOME, topics.ECHO, topics.DIAGNOSTICS, PARAMETERS)
STREAMS = (topics.FIELD, topics.WALL, topics.JOINT_STATES)

Tell = Callable[[topics.Topic | str, Any], None]
"""Called with a topic, or the action whose feedback it is, and a message."""


class Ear:
    """Listens to a node; to its streams only while a page is open, for they cost it time."""

    def __init__(self, client: MemoryClient, tell: Tell) -> None:
        """Subscribe to all but the streams.

        Args:
            client: A client of the node.
            tell: Called with each message, in the thread that spins the client's node.
        """
        self._client = client
        self._tell = tell
        self._streams: list[Any] = []
        for topic in ALWAYS:
            self._subscribe(topic)
        for name, action in action_types().items():
            feedback = f'{client.name}/{name}/_action/feedback'
            kind = action.Impl.FeedbackMessage
            client.node.create_subscription(kind, feedback, partial(tell, name), RELIABLE)

    def watch(self, on: bool) -> None:
        """Start or stop listening to the streams."""
        if on and not self._streams:
            self._streams = [self._subscribe(topic) for topic in STREAMS]
        elif not on:
            while self._streams:
                self._client.node.destroy_subscription(self._streams.pop())

    def _subscribe(self, topic: topics.Topic) -> Any:
        name = topic.name if topic.name[0] == '/' else f'{self._client.name}/{topic.name}'
        qos = SENSOR_DATA if topic in STREAMS else profile(topic.qos)
        return self._client.node.create_subscription(
            topic.kind, name, partial(self._tell, topic), qos
        )
