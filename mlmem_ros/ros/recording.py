# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Recording a session: the node's topics, and what a replay needs beside them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from ..bag import session
from ..bag.definitions import jazzy
from ..bag.errors import BagError
from ..bag.qos import QosProfile
from ..bag.recorder import Recorder, RecorderStatus
from ..bag.writer import BagWriter
from ..device import MemoryElement
from ..device.loop import Stamped
from .inlets import Inlets
from .outlets import Outlets
from .qos import LATCHED, RELIABLE
from .settings import RecordSettings

DROPPED = 'session/dropped'
"""Topic, below the node's name, of the count of messages that found no room in the queue."""


class Recording:
    """One session file: prepared, begun between two ticks, ended between two ticks, closed.

    Attributes:
        full: Whether it has ended by itself at its greatest size.
    """

    def __init__(
        self, node: Node, element: MemoryElement, settings: RecordSettings, path: Path
    ) -> None:
        """Prepare a bag with all its topics.

        Args:
            node: The node whose topics are recorded.
            element: Its device.
            settings: How carefully.
            path: The bag; must not exist.

        Raises:
            BagError: The path exists, or cannot be written.
        """
        self.full = False
        self._node = node
        self._element = element
        self._settings = settings
        name = node.get_fully_qualified_name()
        self._topics = session.SessionTopics.of(name)
        writer = BagWriter(
            path,
            sync_interval=settings.sync_interval,
            max_bytes=settings.max_bytes,
            max_duration=settings.max_duration,
        )
        self._types: dict[str, str] = {}
        for topic, kind, qos in _recorded_topics(settings.views):
            full_name = node.resolve_topic_name(topic)
            self._types[full_name] = _type_name(kind)
            writer.add_topic(full_name, _type_name(kind), (_offered(qos),))
        writer.add_topic(self._topics.header, session.STRING, (_offered(LATCHED),), latch=True)
        for topic in (self._topics.command, self._topics.state_hash):
            writer.add_topic(topic, session.STRING, (_offered(RELIABLE),))
        self._recorder = Recorder(writer, dropped_topic=f'{name}/{DROPPED}', on_error=self._report)
        node.get_logger().info(f'recording a session into {writer.path}')

    def begin(self) -> None:
        """Record the present state, from which a replay starts; to be called between ticks.

        Raises:
            Refused: A procedure runs.
        """
        parameters = self._node.get_parameters_by_prefix('')
        values = {key: parameter.value for key, parameter in parameters.items()}
        name = self._node.get_fully_qualified_name()
        self._put(self._topics.header, session.header(self._element, name, values))

    def put(self, topic: str, cdr: bytes) -> None:
        """Take a message as `rclpy.serialization` gave it; never waits."""
        if not self.full:
            self._put(topic, jazzy().trim(cdr, self._types[topic]))

    def _put(self, topic: str, cdr: bytes) -> None:
        self._recorder.put(topic, cdr, self._now())

    def _now(self) -> int:
        return self._node.get_clock().now().nanoseconds

    def tick(self, commands: Sequence[Stamped]) -> None:
        """Record the commands of a tick, and the state's hash where it is due."""
        if self.full:
            return
        for tick, command in commands:
            self._put(self._topics.command, session.command(tick, command))
        if self._element.ticks % self._settings.hash_every == 0:
            self._put(self._topics.state_hash, session.state_hash(self._element))
            most = self._settings.most_megabytes
            if most and self.status.size >= 1e6 * most:  # the hash just recorded is the last
                self.full = True
                self._node.get_logger().warning(
                    f'the session in {self.status.path} ends at {most:g} MB '
                    '(record.most_megabytes)'
                )

    @property
    def status(self) -> RecorderStatus:
        """How the recording stands."""
        return self._recorder.status

    def end(self) -> None:
        """Record the hash of the last state; to be called between ticks."""
        if not self.full:
            self._put(self._topics.state_hash, session.state_hash(self._element))

    def close(self) -> None:
        """Write what waits and finish the bag."""
        status = self._recorder.close()
        if status.error is None:
            self._node.get_logger().info(
                f'session closed: {status.messages} messages, {status.size / 1e6:.2f} MB, '
                f'{status.dropped} dropped, in {status.path}'
            )

    def _report(self, error: BagError) -> None:
        self._node.get_logger().error(f'recording stopped: {error}')


def _recorded_topics(views: bool) -> list[tuple[str, type[Any], QoSProfile]]:
    return [*Inlets.TOPICS, *Outlets.TOPICS, *(Outlets.VIEWS if views else ())]


def _type_name(kind: type[Any]) -> str:
    package = kind.__module__.split('.')[0]
    return f'{package}/msg/{kind.__name__}'


def _offered(qos: QoSProfile) -> QosProfile:
    reliable = qos.reliability == ReliabilityPolicy.RELIABLE
    latched = qos.durability == DurabilityPolicy.TRANSIENT_LOCAL
    return QosProfile(
        reliability='reliable' if reliable else 'best_effort',
        durability='transient_local' if latched else 'volatile',
    )
