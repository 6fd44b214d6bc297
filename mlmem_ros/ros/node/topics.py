# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The topics of a node: commands that it receives, what it publishes and a session keeps, and how
the values of streams and of a self-test become messages.
"""

from __future__ import annotations

import array
import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from functools import cache, partial
from typing import TYPE_CHECKING, Any

import numpy as np
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.node import Node
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import Image
from std_msgs.msg import MultiArrayDimension, MultiArrayLayout
from visualization_msgs.msg import MarkerArray

from mlmem import Array, Event, MemoryElement, Outcome, Unknown, threads

from ...contract.answers import format_values
from ...contract.commands import COMMAND_TOPICS, CommandTopic, NoCommand
from ...contract.streams import Stream, select_streams
from ...contract.topics import ERROR, OK, Qos, Status
from ...host import Host
from ...host.settings import COLUMN_PERIOD_TICKS, PublishSettings
from ..views import ChainMarkers, Contour

if TYPE_CHECKING:
    from ...host.recording import Recording


class Subscriptions:
    """Turns messages into commands, and logs refusals; no message does harm."""

    def __init__(self, node: Node, host: Host) -> None:
        self._host = host
        for topic in COMMAND_TOPICS:
            name = f'~/{topic.name}'
            listener = self._create_listener(topic, name, node.resolve_topic_name(name))
            node.create_subscription(
                topic.kind, name, listener, topic.qos.profile, raw=True,
                qos_overriding_options=QoSOverridingOptions.with_default_policies(),
            )  # fmt: skip

    def _create_listener(
        self, topic: CommandTopic, name: str, full: str
    ) -> Callable[[bytes], None]:
        kind, log = topic.kind, self._host.log

        def handle_message(cdr: bytes) -> None:
            try:
                message = deserialize_message(cdr, kind)
            except Exception as error:  # the bytes are not such a message
                log.refused(name, f'the message must be a {kind.__name__}; {error}')
                return
            with log.guard_errors(name):
                if (recording := self._host.recording) is not None:
                    recording.put(full, cdr)
                request = self._host.submit_made(lambda element: topic.parse(message, element))
                request.answer.add_done_callback(log_refusal)

        def log_refusal(answer: Future[Any]) -> None:
            refusal = answer.exception()
            if refusal is not None and not isinstance(refusal, NoCommand):
                unit = ''
                if topic.is_in_metres and (element := self._host.element) is not None:
                    unit = f' (a strain of 1 is {element.elongation:g} m)'
                log.refused(name, f'{refusal}{unit}')

        return handle_message


class Publishers:
    """Publishes what the device does, tick by tick, in the loop's thread."""

    def __init__(
        self, node: Node, element: MemoryElement, settings: PublishSettings, host: Host
    ) -> None:
        self._node = node
        self._host = host
        self._element = element
        streams = select_streams(element.settings.holds_words, element.is_simulated)
        group = MutuallyExclusiveCallbackGroup()  # the node's remembers all that ever was in it
        self._publishers = {
            stream.name: node.create_publisher(
                stream.kind,
                f'~/{stream.name}',
                stream.qos.profile,
                callback_group=group,
                qos_overriding_options=QoSOverridingOptions.with_default_policies(),
            )
            for stream in streams
        }
        self._frame_id = settings.frame_id
        self._contour = Contour(element, settings.frame_id) if element.is_simulated else None
        self._markers = cache(partial(ChainMarkers, element, settings))  # few are asked for them
        self._on_events = [stream for stream in streams if not stream.is_periodic]
        self._periodic = [
            (stream, every)
            for stream in streams
            if stream.is_periodic
            and (every := getattr(settings, str(stream.when).rpartition('.')[2]))
        ]
        self._made: dict[str, tuple[int, Any, Sequence[Any]]] = {}  # at rest, since which tick
        self._active: list[tuple[Stream, int]] = []  # when last looked, and for this recording
        self._active_for: Recording | None = None
        self._next_look = -math.inf
        # of a fresh simulated one there is nothing to say, a real one's is not known yet
        if element.reading or element.unknown or not element.is_simulated:
            for stream in self._on_events:
                if stream.reports_event(Unknown('', 0)):
                    self._publish_event(stream, None)

    def close(self) -> None:
        """Stop publishing."""
        for publisher in self._publishers.values():
            self._node.destroy_publisher(publisher)

    def publish(self, name: str, message: Any) -> None:
        """Publish a message, and hand it to the recording: serialized once for both."""
        publisher = self._publishers[name]
        if (recording := self._find_recording(name)) is not None:
            cdr = serialize_message(message)
            publisher.publish(cdr)
            recording.put(publisher.topic_name, cdr)
        else:
            publisher.publish(message)

    def publish_tick(self, events: Sequence[Event]) -> None:
        """Publish the streams due after a tick, and its events."""
        if self._contour is not None:
            self._contour.take_columns()
        for stream, every in self.list_active():
            if self._element.ticks % every == 0:
                self.publish(stream.name, self._current_message(stream))
        for event in events:
            for stream in self._on_events:
                # asked now: there is no next one for who has just come
                if stream.reports_event(event) and self._is_subscribed(stream):
                    self._publish_event(stream, event)

    def _publish_event(self, stream: Stream, event: Event | None) -> None:
        if (message := self._build_message(stream, event)) is not None:
            self.publish(stream.name, message)

    def _now(self) -> Time:
        """Return the time of stamped messages."""
        return self._node.get_clock().now().to_msg()

    def _build_message(self, stream: Stream, event: Event | None = None) -> Any:
        """Return the present message of a stream, of an event or between events; None if it says
        nothing. Its values are a `Status`, an array, a mapping of fields other than the header,
        or what is in the only field, `data`.
        """
        if stream.kind is Image:
            assert self._contour is not None
            return self._contour.build_image(self._now())
        if stream.kind is MarkerArray:
            return self._markers().build_markers(self._now())
        values = stream.values(self._element, event)
        if values is None:
            return None
        if isinstance(values, Status):
            return build_status(values, self._node.get_fully_qualified_name())
        if stream.dimensions:
            return _build_array(stream, values)
        message = stream.kind(**values if isinstance(values, Mapping) else {'data': values})
        if hasattr(message, 'header'):
            message.header.stamp, message.header.frame_id = self._now(), self._frame_id
        return message

    def _current_message(self, stream: Stream) -> Any:
        """Return the message of a stream: of an element at rest it is made once, and stamped."""
        element = self._element
        if element.ticks == element.computed or stream.kind is Image:
            return self._build_message(stream)
        since, made, headers = self._made.get(stream.name, (-1, None, ()))
        if since != element.computed:
            made = self._build_message(stream)
            parts = getattr(made, 'markers', (made,))
            headers = [each.header for each in parts if hasattr(each, 'header')]
            self._made[stream.name] = element.computed, made, headers
        elif headers:
            stamp = self._now()
            for header in headers:
                header.stamp = stamp
        return made

    def has_subscribers(self) -> bool:
        """Return whether anybody takes a stream that must be on time: views may be late."""
        return any(stream.is_recorded for stream, _ in self.list_active())

    def find_period(self) -> int:
        """Return the ticks of which those of all streams that anybody takes are multiples; 0 if
        nobody takes any.
        """
        active = self.list_active()
        is_pictured = any(stream.kind is Image for stream, _ in active)
        columns = COLUMN_PERIOD_TICKS if is_pictured else 0
        return math.gcd(*(every for _, every in active), columns)

    def list_active(self) -> list[tuple[Stream, int]]:
        """Return the periodic streams that anybody takes, or took a moment ago, with the ticks
        between two messages; in the loop's thread.
        """
        now, recording = threads.monotonic(), self._host.recording
        if now >= self._next_look or recording is not self._active_for:
            self._active = [each for each in self._periodic if self._is_subscribed(each[0])]
            self._active_for = recording
            self._next_look = now + 0.02  # a look takes the middleware microseconds a stream
        return self._active

    def _is_subscribed(self, stream: Stream) -> bool:
        if stream.qos is Qos.LATCHED or self._find_recording(stream.name) is not None:
            return True
        return bool(self._publishers[stream.name].get_subscription_count())

    def _find_recording(self, name: str) -> Recording | None:
        """Return what takes the messages of a stream, or None."""
        recording = self._host.recording
        taken = recording is not None and recording.takes_topic(self._publishers[name].topic_name)
        return recording if taken else None


# --- messages ---------------------------------------------------------------------------------


def build_status(status: Status, node: str, component: str = '') -> DiagnosticStatus:
    """Return a status of the node of this full name, or of one of its components."""
    texts = format_values(status.values)
    return DiagnosticStatus(
        level=bytes([status.severity]),
        name=f'{node[1:]}: {component}' if component else node.rpartition('/')[2],
        message=status.text,
        hardware_id=node,
        values=[KeyValue(key=key, value=value) for key, value in texts.items()],
    )


def _build_array(stream: Stream, values: Array) -> Any:
    """Return an array with its layout, in the only type that rclpy does not check by element."""
    sizes = [size for _, size in stream.dimensions]
    shape = values.reshape(-1)[stream.offset :].reshape(sizes).shape
    dimensions: list[MultiArrayDimension] = []
    stride = 1
    for (label, _), size in reversed(list(zip(stream.dimensions, shape, strict=True))):
        stride *= size
        dimensions.insert(0, MultiArrayDimension(label=label, size=size, stride=stride))
    single = 'Float32' in stream.type
    data = array.array('f' if single else 'd')
    data.frombytes(values.astype(np.float32 if single else np.float64).tobytes())
    layout = MultiArrayLayout(dim=dimensions, data_offset=stream.offset)
    return stream.kind(layout=layout, data=data)


def build_test_statuses(outcome: Outcome, node: str) -> list[DiagnosticStatus]:
    """Return one status for every check of a self-test, or a single one without checks."""
    return [
        build_status(
            Status(OK if check.passed else ERROR, check.message, check.values), node, check.name
        )
        for check in outcome.checks
    ] or [build_status(Status(ERROR, outcome.error), node, 'self_test')]
