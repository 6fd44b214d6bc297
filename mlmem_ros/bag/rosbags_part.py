# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An SQLite file, or a bag compressed as a whole, read by `rosbags`."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import cast

from rosbags.interfaces import Connection, ConnectionExtRosbag2, MessageDefinitionFormat
from rosbags.rosbag2 import Reader

from .contents import Definition, Loss, Message, TopicInfo, qos_text
from .errors import BagError

_ENCODINGS = {
    MessageDefinitionFormat.NONE: '',
    MessageDefinitionFormat.MSG: 'ros2msg',
    MessageDefinitionFormat.IDL: 'ros2idl',
}


class RosbagsPart:
    """Anything that `rosbags` can read, as a `McapPart`."""

    def __init__(self, path: Path) -> None:
        """Read an SQLite file or a bag directory once, to learn what is there.

        Raises:
            BagError: It cannot be read to its end.
        """
        self.path = path
        self.topics: dict[str, TopicInfo] = {}
        self.definitions: dict[str, Definition] = {}
        self.losses: list[Loss] = []
        self.span: tuple[int, int] | None = None
        self.metadata_text: str | None = None
        self._readable = 0  # messages before any damage
        try:
            with _opened(path) as reader:
                for connection in reader.connections:
                    self._collect(connection)
                for connection, log_time, _ in reader.messages():
                    self._count(connection.topic, log_time)
        except BagError as error:
            if not self._readable:
                raise
            self.losses.append(Loss.of(path, error))

    def messages(self, topics: Collection[str], as_written: bool = False) -> Iterator[Message]:
        """Yield the messages of some topics in the order of their log times alone.

        Raises:
            BagError: The file has changed since it was opened.
        """
        with _opened(self.path) as reader:
            for connection, log_time, cdr in islice(reader.messages(), self._readable):
                if connection.topic in topics:
                    yield Message(connection.topic, connection.msgtype, log_time, log_time, cdr)

    def _collect(self, connection: Connection) -> None:
        extension = cast('ConnectionExtRosbag2', connection.ext)
        self.topics.setdefault(
            connection.topic,
            TopicInfo(
                name=connection.topic,
                type=connection.msgtype,
                serialization_format=extension.serialization_format,
                offered_qos=qos_text(extension.offered_qos_profiles),
                type_hash=connection.digest,
            ),
        )
        self.definitions[connection.msgtype] = Definition(
            connection.msgtype, connection.msgdef.data, _ENCODINGS[connection.msgdef.format]
        )

    def _count(self, topic: str, log_time: int) -> None:
        self._readable += 1
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
