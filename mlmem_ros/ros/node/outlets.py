# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The topics the node publishes, which a session records in serialized form."""

from __future__ import annotations

from collections.abc import Callable, Sequence
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
        self._periodic = self._streams()
        streaming = [topic for topic, _, _ in self._periodic if topic not in topics.VIEWS]
        self._punctual = [self._publishers[topic] for topic in streaming]  # views may be late
        if element.reading is not None or not element.simulated:  # a real one's is not known yet
            self.publish(topics.LEVEL, messages.level(element.reading))

    def _streams(self) -> list[tuple[Topic, int, Callable[[], Any]]]:
        """Return what is published periodically: the topic, the ticks between two, the message."""
        element, settings, stamp = self._element, self._settings, self._stamp
        streams: list[tuple[Topic, int, Callable[[], Any]]] = [
            (
                topics.JOINT_STATES,
                settings.joint_states_every,
                lambda: messages.joint_states(element, stamp(), settings.frame_id),
            )
        ]
        if (contour := self._contour) is not None:
            markers = ChainMarkers(element, settings)
            streams += [
                (topics.FIELD, settings.field_every, lambda: messages.field(element)),
                (topics.WALL, settings.wall_every, lambda: messages.wall_positions(element)),
                (topics.IMAGE, settings.image_every, lambda: contour.message(stamp())),
                (topics.MARKERS, settings.markers_every, lambda: markers.message(stamp())),
            ]
        return [stream for stream in streams if stream[1]]

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
        if self._contour is not None:
            self._contour.take()
        for topic, every, message in self._periodic:
            if self._element.ticks % every == 0 and self._watched(topic):
                self.publish(topic, message())
        for event in events:
            if isinstance(event, Heard):
                self._publish_heard(event)
            else:
                self._publish_outcome(event)

    @property
    def heard(self) -> bool:
        """Whether anybody subscribes to a stream that must be on time."""
        return any(publisher.get_subscription_count() for publisher in self._punctual)

    def _watched(self, topic: Topic) -> bool:
        """Return whether anybody takes a message that is not latched."""
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
