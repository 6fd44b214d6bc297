# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a node tells, as it comes in: an ordinary subscriber of its public topics."""

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
"""Is told a topic, or of which action it is the feedback, and a message."""


class Ear:
    """Listens to a node: to its streams only while somebody looks, for they cost it something."""

    def __init__(self, client: MemoryClient, tell: Tell) -> None:
        """Listen to what is told once.

        Args:
            client: A client of the node.
            tell: Is told what comes, in the thread that turns the client's node.
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
        """Listen to the streams, or no longer."""
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
