# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a bag holds: topics, messages, and what of it was lost; and rosbag2's metadata, which say
so: written as Jazzy writes them (version 9), read from any.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePath
from typing import Any, NamedTuple

import yaml  # type: ignore[import-untyped]

from mlmem import atomic_files
from mlmem.parsing import parse_yaml, require_regular
from mlmem.schema import short_repr

from .errors import BagError, storage_errors


@dataclass
class TopicInfo:
    """One topic of a bag.

    Attributes:
        type: Name of the message type; empty when the bag does not say.
        type_hash: The type's RIHS01 hash; empty when unknown.
        message_count: How many messages it has.
        offered_qos: QoS of each of its publishers, as of `describe_qos`; not read from a bag.
        begins_file: Whether a file of a split bag begins with it; not read from a bag.
    """

    name: str
    type: str
    type_hash: str = ''
    message_count: int = 0
    offered_qos: Sequence[Mapping[str, Any]] = ()
    begins_file: bool = False


class Message(NamedTuple):
    """One recorded message, still encoded.

    Attributes:
        type: Name of the message type; empty when the bag does not say.
        log_time: When it was received, in nanoseconds.
        cdr: The encoded message.
    """

    topic: str
    type: str
    log_time: int
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


NOT_CLOSED_REASON = 'the file was not closed'
"""Begins the reason of a loss: nothing is damaged, but the end of the recording is missing."""


def describe_qos(reliability: str = 'reliable', durability: str = 'volatile') -> dict[str, Any]:
    """Return the QoS of one publisher with unlimited durations, by rosbag2's keys.

    History and depth are ``unknown`` and 0, as ``ros2 bag record`` writes them: discovery does
    not carry them.
    """
    sec, nsec = 9223372036, 854775807
    return {
        'history': 'unknown',
        'depth': 0,
        'reliability': reliability,
        'durability': durability,
        'deadline': {'sec': sec, 'nsec': nsec},
        'lifespan': {'sec': sec, 'nsec': nsec},
        'liveliness': 'automatic',
        'liveliness_lease_duration': {'sec': sec, 'nsec': nsec},
        'avoid_ros_namespace_conventions': False,
    }


@dataclass
class FileInfo:
    """One storage file of a bag. Times are in nanoseconds since the epoch, or of the ROS clock;
    a file without messages begins at the largest.
    """

    path: str
    starting_time: int = 2**63 - 1
    duration: int = 0
    message_count: int = 0

    def add(self, log_time: int) -> None:
        """Count a message; its log time is in nanoseconds."""
        end = max(self.starting_time + self.duration, log_time) if self.message_count else log_time
        self.starting_time = min(self.starting_time, log_time)
        self.duration = end - self.starting_time
        self.message_count += 1


@dataclass(frozen=True)
class BagMetadata:
    """What a reader needs of the metadata.

    Attributes:
        files: Names of the storage files, in the order they were written.
        compressed: Whether the files or messages are compressed as a whole.
    """

    files: tuple[str, ...] = ()
    message_counts: Mapping[str, int] = field(default_factory=dict)
    compressed: bool = False


def format_yaml(document: Any) -> str:
    """Return a document as YAML text, in lines that are not broken."""
    dumper = getattr(yaml, 'CSafeDumper', yaml.SafeDumper)  # ten times as fast, with libyaml
    text: str = yaml.dump(
        document, Dumper=dumper, sort_keys=False, allow_unicode=True, width=2**31 - 1
    )
    return text.rstrip('\n')


def format_metadata(topics: Iterable[TopicInfo], files: Sequence[FileInfo]) -> str:
    """Return the text of the ``metadata.yaml`` of a bag of at least one file."""
    filled = [file for file in files if file.message_count] or files
    start = min(file.starting_time for file in filled)
    end = max(file.starting_time + file.duration for file in filled)
    described = {
        'version': 9,
        'storage_identifier': 'mcap',
        'duration': {'nanoseconds': end - start},
        'starting_time': {'nanoseconds_since_epoch': start},
        'message_count': sum(file.message_count for file in files),
        'topics_with_message_count': [
            {
                'topic_metadata': {
                    'name': topic.name,
                    'type': topic.type,
                    'serialization_format': 'cdr',
                    'offered_qos_profiles': list(topic.offered_qos),
                    'type_description_hash': topic.type_hash,
                },
                'message_count': topic.message_count,
            }
            for topic in topics
        ],
        'compression_format': '',
        'compression_mode': '',
        'relative_file_paths': [file.path for file in files],
        'files': [
            {
                'path': file.path,
                'starting_time': {'nanoseconds_since_epoch': file.starting_time},
                'duration': {'nanoseconds': file.duration},
                'message_count': file.message_count,
            }
            for file in files
        ],
        'custom_data': None,  # as yaml-cpp writes rosbag2's empty map
        'ros_distro': 'jazzy',
    }
    return format_yaml({'rosbag2_bagfile_information': described})


def parse_metadata(text: str, max_chars: int = 2**18) -> BagMetadata:
    """Read the metadata of any rosbag2 version: YAML text with or without the root key.

    Args:
        max_chars: Most characters that are read: metadata of 400 topics.

    Raises:
        BagError: The text is not rosbag2 metadata.
    """
    try:
        if len(text) > max_chars:
            raise ValueError(f'{len(text)} characters')
        # Every scalar stays a string, whatever YAML takes it for.
        document: Any = parse_yaml(text, texts=True)
        node = document.get('rosbag2_bagfile_information', document)
        return BagMetadata(
            # rosbag2 before version 4 wrote the directory's name too.
            files=tuple(
                PurePath(_require_text(path)).name for path in node['relative_file_paths'] or ()
            ),
            message_counts={
                _require_text(topic['topic_metadata']['name']): int(topic['message_count'])
                for topic in node['topics_with_message_count'] or ()
            },
            compressed=_require_text(node.get('compression_mode', '')).lower() not in {'', 'none'},
        )
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise BagError(f'The text must be rosbag2 metadata; got {short_repr(text)}.') from error


def read_metadata(directory: Path) -> BagMetadata | None:
    """Return what ``metadata.yaml`` says; None when there is none (``ros2 bag record`` writes it
    last).

    Raises:
        BagError: The file cannot be read, or is not rosbag2 metadata.
    """
    path = directory / 'metadata.yaml'
    with storage_errors(f'read {path}'):
        if not atomic_files.path_exists(path):
            return None
        require_regular(path)
        with path.open('rb') as file:
            content = file.read(2**20 + 1)  # more than `parse_metadata` takes
    return parse_metadata(content.decode('utf-8', errors='replace'))


def _require_text(value: object) -> str:
    # Nested lists of aliases expand without bound when written out.
    if not isinstance(value, str):
        raise ValueError(f'got {short_repr(value)} for a text')
    return value
