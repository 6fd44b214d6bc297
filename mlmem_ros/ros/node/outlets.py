# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The topics the node publishes, which a session records in serialized form."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from rclpy.node import Node
from rclpy.serialization import serialize_message

from ...contract import messages, topics
from ...contract.topics import Topic
from ...device import Event, Heard, MemoryElement, Outcome
from ...host import Host
from ...host.settings import PublishSettings
from ..qos import profile
from ..views.image import Contour
from ..views.markers import ChainMarkers

if TYPE_CHECKING:
    from ...host.transcript import Transcript


class Outlets:
    """Publishes what the device does, tick by tick, in the loop's thread."""

    def __init__(
        self, node: Node, element: MemoryElement, settings: PublishSettings, host: Host
    ) -> None:
        self._node = node
        self._host = host
        self._element = element
        self._settings = settings
        self._publishers = {
            topic: node.create_publisher(topic.kind, f'~/{topic.name}', profile(topic.qos))
            for topic in topics.STREAMS + topics.VIEWS
            if element.simulated or topic not in topics.OF_A_SIMULATION
        }
        self._contour = Contour(element, settings) if element.simulated else None
        self._markers = ChainMarkers(element, settings)
        if (
            element.reading is not None or not element.simulated
        ):  # restored, or for an echo to determine
            self.publish(topics.LEVEL, messages.level(element.reading))

    def close(self) -> None:
        """Stop publishing."""
        for publisher in self._publishers.values():
            self._node.destroy_publisher(publisher)

    def publish(self, topic: Topic, message: Any) -> None:
        """Publish a message, and hand it to the transcript: serialized once for both."""
        publisher = self._publishers[topic]
        if (transcript := self._transcript(topic)) is not None:
            cdr = serialize_message(message)
            publisher.publish(cdr)
            transcript.put(publisher.topic_name, cdr)
        else:
            publisher.publish(message)

    def tick(self, events: Sequence[Event]) -> None:
        """Publish the streams due after a tick, and its events."""
        element, settings, ticks = self._element, self._settings, self._element.ticks
        if _due(ticks, settings.field_every) and self._watched(topics.FIELD):
            self.publish(topics.FIELD, messages.field(element))
        if _due(ticks, settings.wall_every) and self._watched(topics.WALL):
            self.publish(topics.WALL, messages.wall_positions(element))
        if _due(ticks, settings.joint_states_every) and self._watched(topics.JOINT_STATES):
            self.publish(
                topics.JOINT_STATES,
                messages.joint_states(element, self._stamp(), settings.frame_id),
            )
        if self._contour is not None:
            self._contour.take()
            if _due(ticks, settings.image_every) and self._watched(topics.IMAGE):
                self.publish(topics.IMAGE, self._contour.message(self._stamp()))
        if _due(ticks, settings.markers_every) and self._watched(topics.MARKERS):
            self.publish(topics.MARKERS, self._markers.message(self._stamp()))
        for event in events:
            if isinstance(event, Heard):
                self._publish_heard(event)
            else:
                self._publish_outcome(event)

    @property
    def heard(self) -> bool:
        """Whether anybody takes a periodic stream."""
        return any(
            self._publishers[topic].get_subscription_count()
            for topic in (topics.FIELD, topics.WALL, topics.JOINT_STATES)
        )

    def _watched(self, topic: Topic) -> bool:
        """Return whether anybody takes a message that is not latched."""
        if topic not in self._publishers:
            return False
        recorded = self._transcript(topic) is not None
        return recorded or self._publishers[topic].get_subscription_count() > 0

    def _transcript(self, topic: Topic) -> Transcript | None:
        """Return what takes the messages of a topic, or None."""
        transcript = self._host.transcript
        taken = transcript is not None and transcript.takes(self._publishers[topic].topic_name)
        return transcript if taken else None

    def _publish_heard(self, heard: Heard) -> None:
        if self._watched(topics.ECHO):
            self.publish(topics.ECHO, messages.echo(heard.echo))
        distance = messages.distance(
            heard.reading, self._element, self._stamp(), self._settings.frame_id
        )
        self.publish(topics.RANGE, distance)

    def _publish_outcome(self, outcome: Outcome) -> None:
        self.publish(
            topics.OUTCOME, messages.status(outcome, self._node.get_fully_qualified_name())
        )
        self.publish(topics.LEVEL, messages.level(self._element.reading))

    def _stamp(self) -> Any:
        return self._node.get_clock().now().to_msg()


def _due(ticks: int, every: int) -> bool:
    return every > 0 and ticks % every == 0
