# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The messages of SQLite bags and of bags compressed as a whole, read by `rosbags`."""

from __future__ import annotations

import heapq
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import cast

from rosbags.interfaces import (
    Connection,
    ConnectionExtRosbag2,
    MessageDefinitionFormat,
    Qos,
    QosTime,
)
from rosbags.rosbag2 import Reader

from .contents import Loss, Message
from .definitions import Definition
from .errors import BagError
from .metadata import TopicInfo
from .qos import QosProfile

_ENCODINGS = {
    MessageDefinitionFormat.NONE: '',
    MessageDefinitionFormat.MSG: 'ros2msg',
    MessageDefinitionFormat.IDL: 'ros2idl',
}


class RosbagsSource:
    """Reads any bag that `rosbags` can read.

    Attributes:
        topics: The topics by name, with the number of messages that can be read.
        definitions: The message definitions of the bag.
        losses: What cannot be read.
        span: Earliest and latest log time in nanoseconds, or None without messages.
        metadata_text: Always None; the metadata of these bags is in ``metadata.yaml``.
    """

    def __init__(self, paths: Sequence[Path]) -> None:
        """Read everything once, to learn what is there and how far it is readable.

        Args:
            paths: SQLite files in the order they were written, or one bag directory.

        Raises:
            BagError: None of them can be read.
        """
        self.topics: dict[str, TopicInfo] = {}
        self.definitions: list[Definition] = []
        self.losses: list[Loss] = []
        self.span: tuple[int, int] | None = None
        self.metadata_text: str | None = None
        self._readable: dict[Path, int] = {}
        errors: list[BagError] = []
        for path in paths:
            self._readable[path] = 0
            try:
                with _opened(path) as reader:
                    for connection in reader.connections:
                        self._collect(connection)
                    for connection, log_time, _ in reader.messages():
                        self._count(path, connection.topic, log_time)
            except BagError as error:
                errors.append(error)
                size = path.stat().st_size if path.is_file() else 0
                self.losses.append(Loss(path, 0, size, str(error)))
        if errors and not self.topics:
            raise errors[0]

    def messages(self, topics: Collection[str]) -> Iterator[Message]:
        """Read messages in the order of their log times.

        Args:
            topics: Names of the wanted topics.

        Yields:
            Messages; those with equal log times in the order they were written.

        Raises:
            BagError: The bag has changed since it was opened.
        """
        streams = (self._read(path, count) for path, count in self._readable.items() if count)
        for message in heapq.merge(*streams, key=lambda message: message.log_time):
            if message.topic in topics:
                yield message

    def _read(self, path: Path, count: int) -> Iterator[Message]:
        # As many as could be read when the bag was opened: damage follows them.
        with _opened(path) as reader:
            for connection, log_time, cdr in islice(reader.messages(), count):
                yield Message(connection.topic, connection.msgtype, log_time, log_time, cdr)

    def _collect(self, connection: Connection) -> None:
        extension = cast('ConnectionExtRosbag2', connection.ext)
        info = TopicInfo(
            name=connection.topic,
            type=connection.msgtype,
            serialization_format=extension.serialization_format,
            offered_qos_profiles=tuple(map(_profile, extension.offered_qos_profiles)),
            type_description_hash=connection.digest,
        )
        self.topics.setdefault(connection.topic, info)
        encoding = _ENCODINGS[connection.msgdef.format]
        self.definitions.append(Definition(connection.msgtype, connection.msgdef.data, encoding))

    def _count(self, path: Path, topic: str, log_time: int) -> None:
        self._readable[path] += 1
        info = self.topics[topic]
        self.topics[topic] = replace(info, message_count=info.message_count + 1)
        start, end = self.span or (log_time, log_time)
        self.span = min(start, log_time), max(end, log_time)


@contextmanager
def _opened(path: Path) -> Iterator[Reader]:
    try:
        with Reader(path) as reader:
            yield reader
    except Exception as error:  # SQLite, zstd and rosbags each raise their own errors
        raise BagError(f'Cannot read {path}: {error}') from error


def _profile(qos: Qos) -> QosProfile:
    return QosProfile(
        history=qos.history.name.lower(),
        depth=qos.depth,
        reliability=qos.reliability.name.lower(),
        durability=qos.durability.name.lower(),
        deadline=_nanoseconds(qos.deadline),
        lifespan=_nanoseconds(qos.lifespan),
        liveliness=qos.liveliness.name.lower(),
        liveliness_lease_duration=_nanoseconds(qos.liveliness_lease_duration),
        avoid_ros_namespace_conventions=qos.avoid_ros_namespace_conventions,
    )


def _nanoseconds(time: QosTime) -> int:
    return time.sec * 10**9 + time.nsec
