# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a bag holds: topics, definitions of their types, messages; and what of it was lost."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple


@dataclass(frozen=True)
class Definition:
    """A message type as a bag holds it.

    Attributes:
        type: Name of the type, such as ``std_msgs/msg/Float64``.
        text: Definition of the type and of all it depends on.
        encoding: Language of the text, such as ``ros2msg`` or ``ros2idl``.
        hash: The type's RIHS01 hash; empty when unknown.
    """

    type: str
    text: str = ''
    encoding: str = ''
    hash: str = ''


@dataclass(frozen=True)
class TopicInfo:
    """One topic of a bag.

    Attributes:
        type: Name of the message type; empty when the bag does not say.
        serialization_format: Encoding of the messages.
        offered_qos: QoS of each of its publishers, as rosbag2's YAML text.
        type_hash: The type's RIHS01 hash; empty when unknown.
        message_count: How many messages it has.
    """

    name: str
    type: str
    serialization_format: str = 'cdr'
    offered_qos: str = ''
    type_hash: str = ''
    message_count: int = 0


class Message(NamedTuple):
    """One recorded message, still encoded.

    Attributes:
        type: Name of the message type; empty when the bag does not say.
        log_time: When it was received, in nanoseconds.
        publish_time: When it was sent, in nanoseconds; the log time if the bag has none.
        cdr: The encoded message.
    """

    topic: str
    type: str
    log_time: int
    publish_time: int
    cdr: bytes


@dataclass(frozen=True)
class Loss:
    """A stretch of a file that could not be read.

    Attributes:
        offset: Where in the file the stretch begins, in bytes.
        size: Its length in bytes; 0 when nothing is damaged but something is missing.
        reason: What is wrong with it.
    """

    file: Path
    offset: int
    size: int
    reason: str

    @classmethod
    def of(cls, file: Path, error: Exception) -> Loss:
        """Return the loss of a whole file."""
        return cls(file, 0, file.stat().st_size if file.is_file() else 0, str(error))

    def __str__(self) -> str:
        size = f'{self.size} bytes lost, ' if self.size else ''
        return f'{self.file}, byte {self.offset}: {size}{self.reason}'


OFFERED_QOS, TYPE_HASH = 'offered_qos_profiles', 'topic_type_hash'
"""Keys in the metadata of every MCAP channel."""

NOT_CLOSED = 'the file was not closed'
"""Begins the reason of a loss: nothing is damaged, but the end of the recording is missing."""
