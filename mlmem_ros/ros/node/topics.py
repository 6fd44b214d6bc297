# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The topics of a node: commands that it hears, and what it publishes and a session keeps."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from functools import cache, partial
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, NamedTuple

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.node import Node
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import Imu

from mlmem import Event, MemoryElement, threads

from ...contract import messages, topics
from ...contract.commands import TOPIC_PARSERS, NoCommand
from ...contract.topics import Topic
from ...contract.values import collect_published, published_content
from ...host import Host
from ...host.settings import PublishSettings
from ..middleware import build_override_options, build_qos_profile
from ..views import ChainMarkers, Contour

if TYPE_CHECKING:
    from ...host.recording import Recording

LITTLE_ENDIAN_HEADER = b'\x00\x01'
"""How CDR begins on nearly every machine: plain, little-endian."""

NUMBERS, ACCELERATION, COVARIANCE = 37, 25, 28
"""Numbers after the header; indices where linear acceleration and its covariance begin."""


def decode_imu(cdr: bytes) -> Any:
    """Return an Imu's linear acceleration along x and first covariance, under its own names.

    Raises:
        What the middleware raises if the bytes are not an Imu.
    """
    if cdr[:2] == LITTLE_ENDIAN_HEADER and len(cdr) >= 16:
        header = 12 + struct.unpack_from('<I', cdr, 12)[0]  # stamp, and the name of the frame
        begin = 4 + (header + 7) // 8 * 8
        if len(cdr) >= begin + 8 * NUMBERS:
            x, covariance = (
                struct.unpack_from('<d', cdr, begin + 8 * place)[0]
                for place in (ACCELERATION, COVARIANCE)
            )
            return SimpleNamespace(
                linear_acceleration=SimpleNamespace(x=x),
                linear_acceleration_covariance=(covariance,),
            )
    return deserialize_message(cdr, Imu)


METRE_TOPICS = (topics.STRAIN_TRAJECTORY_TOPIC, topics.JOINT_COMMANDS_TOPIC)


class Subscriptions:
    """Turns messages into commands, and logs refusals; no message does harm."""

    def __init__(self, node: Node, host: Host) -> None:
        self._host = host
        for topic in topics.COMMAND_TOPICS:
            name = f'~/{topic.name}'
            listener = self._create_listener(topic, name, node.resolve_topic_name(name))
            node.create_subscription(
                topic.kind, name, listener, build_qos_profile(topic.qos), raw=True,
                qos_overriding_options=build_override_options(),
            )  # fmt: skip

    def _create_listener(
        self, topic: topics.Topic, name: str, full: str
    ) -> Callable[[bytes], None]:
        kind, make = topic.kind, TOPIC_PARSERS[topic.name]
        whole = partial(deserialize_message, message_type=kind)
        decode: Callable[[bytes], Any] = decode_imu if topic is topics.DISTURBANCE_TOPIC else whole
        log = self._host.log

        def handle_message(cdr: bytes) -> None:
            try:
                message = decode(cdr)
            except Exception as error:  # the bytes are not such a message
                log.refused(name, f'the message must be a {kind.__name__}; {error}')
                return
            with log.guard_errors(name):
                if (recording := self._host.recording) is not None:
                    recording.put(full, cdr)
                request = self._host.submit_scaled(lambda units: make(message, units))
                request.answer.add_done_callback(log_refusal)

        def log_refusal(answer: Future[Any]) -> None:
            refusal = answer.exception()
            if refusal is not None and not isinstance(refusal, NoCommand):
                unit = ''
                if topic in METRE_TOPICS and (element := self._host.element) is not None:
                    unit = f' (a strain of 1 is {element.units.elongation:g} m)'
                log.refused(name, f'{refusal}{unit}')

        return handle_message


SUBSCRIBER_CHECK_PERIOD_S = 0.02
"""Seconds for which it holds who takes what stream: the middleware takes microseconds for each."""


class Taken(NamedTuple):
    """Which streams were worth publishing a moment ago.

    Attributes:
        topics: Those that are recorded, or that somebody subscribes to.
        on_time: Whether a stream that must be on time is among them.
        period: Ticks of which those of all streams among them are multiples; 0 without one.
        recording: The recording of then.
        until: When to look again, on the steady clock.
    """

    topics: frozenset[Topic] = frozenset()
    on_time: bool = False
    period: int = 0
    recording: Recording | None = None
    until: float = -math.inf


class Publishers:
    """Publishes what the device does, tick by tick, in the loop's thread."""

    def __init__(
        self, node: Node, element: MemoryElement, settings: PublishSettings, host: Host
    ) -> None:
        self._node = node
        self._host = host
        self._element = element
        self._settings = settings
        group = MutuallyExclusiveCallbackGroup()  # the node's remembers all that ever was in it
        self._publishers = {
            topic: node.create_publisher(
                topic.kind,
                f'~/{topic.name}',
                build_qos_profile(topic.qos),
                callback_group=group,
                qos_overriding_options=build_override_options(),
            )
            for topic in topics.published_topics(element.reader.holds_words, element.simulated)
        }
        self._contour = Contour(element, settings) if element.simulated else None
        self._messages = self._build_event_messages(node.get_fully_qualified_name())
        self._periodic = self._list_periodic_streams()
        self._made: dict[Topic, tuple[int, Any, Sequence[Any]]] = {}  # at rest, since which tick
        self._last_look = Taken()
        # of a fresh simulated one there is nothing to say, a real one's is not known yet
        if element.reading or element.unknown or not element.simulated:
            for topic, content in published_content(element).items():
                self._publish_event(topic, content)

    def _list_periodic_streams(self) -> list[tuple[Topic, int, Callable[[], Any]]]:
        """Return what is published periodically: the topic, the ticks between two, the message."""
        element, settings, stamp = self._element, self._settings, self._current_stamp
        made: dict[Topic, Callable[[], Any]] = {
            topics.JOINT_STATES_TOPIC: lambda: messages.build_joint_states(
                element, stamp(), settings.frame_id
            )
        }
        if (contour := self._contour) is not None:
            markers = cache(partial(ChainMarkers, element, settings))  # few are asked for them
            made |= {
                topics.FIELD_TOPIC: lambda: messages.build_field(element),
                topics.WALL_TOPIC: lambda: messages.build_wall_positions(element),
                topics.IMAGE_TOPIC: lambda: contour.message(stamp()),
                topics.MARKERS_TOPIC: lambda: markers().message(stamp()),
            }
        every = {topic: getattr(settings, topic.interval.partition('.')[2]) for topic in made}
        return [(topic, every[topic], make) for topic, make in made.items() if every[topic]]

    def _build_event_messages(self, name: str) -> dict[Topic, Callable[[Any], Any]]:
        """Return what makes the message of what an event publishes; `name` is the node's."""
        element, frame_id = self._element, self._settings.frame_id
        return {
            topics.ECHO_TOPIC: messages.build_echo,
            topics.RANGE_TOPIC: lambda read: messages.build_range(
                read, element, self._current_stamp(), frame_id
            ),
            topics.WAVEFORM_TOPIC: messages.build_waveform,
            topics.OUTCOME_TOPIC: lambda outcome: messages.build_outcome(outcome, name),
            topics.LEVEL_TOPIC: messages.build_level,
            topics.WORD: messages.word,
            topics.CONTENT_TOPIC: lambda element: messages.build_content(element, name),
        }

    def close(self) -> None:
        """Stop publishing."""
        for publisher in self._publishers.values():
            self._node.destroy_publisher(publisher)

    def publish(self, topic: Topic, message: Any) -> None:
        """Publish a message, and hand it to the recording: serialized once for both."""
        publisher = self._publishers[topic]
        if (recording := self._find_recording(topic)) is not None:
            cdr = serialize_message(message)
            publisher.publish(cdr)
            recording.put(publisher.topic_name, cdr)
        else:
            publisher.publish(message)

    def tick(self, events: Sequence[Event]) -> None:
        """Publish the streams due after a tick, and its events."""
        if self._contour is not None:
            self._contour.take()
        taken = self.active_streams.topics
        for topic, every, message in self._periodic:
            if self._element.ticks % every == 0 and topic in taken:
                self.publish(topic, self._current_message(topic, message))
        for event in events:
            for topic, content in collect_published(event, self._element).items():
                if self._is_subscribed(topic):  # now: there is no next one for who has just come
                    self._publish_event(topic, content)

    def _publish_event(self, topic: Topic, content: Any) -> None:
        self.publish(topic, self._messages[topic](content))

    def _current_message(self, topic: Topic, message: Callable[[], Any]) -> Any:
        """Return the message of a stream: of an element at rest it is made once, and stamped."""
        element = self._element
        if element.ticks == element.computed or topic is topics.IMAGE_TOPIC:
            return message()
        since, made, headers = self._made.get(topic, (-1, None, ()))
        if since != element.computed:
            made = message()
            parts = getattr(made, 'markers', (made,))
            headers = [each.header for each in parts if hasattr(each, 'header')]
            self._made[topic] = element.computed, made, headers
        elif headers:
            stamp = self._current_stamp()
            for header in headers:
                header.stamp = stamp
        return made

    @property
    def active_streams(self) -> Taken:
        """Who takes which stream, or did a moment ago; in the loop's thread."""
        now, recording = threads.monotonic(), self._host.recording
        if now >= self._last_look.until or recording is not self._last_look.recording:
            streams = {
                topic: every for topic, every, _ in self._periodic if self._is_subscribed(topic)
            }
            columns = self._settings.column_every if topics.IMAGE_TOPIC in streams else 0
            self._last_look = Taken(
                frozenset(streams),
                any(topic not in topics.VIEW_TOPICS for topic in streams),  # views may be late
                math.gcd(*streams.values(), columns),
                recording,
                now + SUBSCRIBER_CHECK_PERIOD_S,
            )
        return self._last_look

    def _is_subscribed(self, topic: Topic) -> bool:
        if topic.qos == topics.LATCHED_QOS or self._find_recording(topic) is not None:
            return True
        return bool(self._publishers[topic].get_subscription_count())

    def _find_recording(self, topic: Topic) -> Recording | None:
        """Return what takes the messages of a topic, or None."""
        recording = self._host.recording
        taken = recording is not None and recording.takes_topic(self._publishers[topic].topic_name)
        return recording if taken else None

    def _current_stamp(self) -> Any:
        return self._node.get_clock().now().to_msg()
