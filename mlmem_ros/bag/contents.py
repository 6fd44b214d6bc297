# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a bag holds: topics, definitions of their types, messages, and what of it was lost; and
rosbag2's metadata, which say so: written as Jazzy writes them (version 9), read from any.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path, PurePath
from typing import Any, NamedTuple

import yaml  # type: ignore[import-untyped]

from mlmem import atomic_files
from mlmem.parsing import parse_yaml, require_regular
from mlmem.schema import short_repr

from .errors import BagError, storage_errors


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


LIBRARY_NAME = 'mlmem_ros'
"""Begins the name of the program in our files, and names our record in them."""

OFFERED_QOS, TYPE_HASH = 'offered_qos_profiles', 'topic_type_hash'
"""Keys in the metadata of every MCAP channel."""

NOT_CLOSED_REASON = 'the file was not closed'
"""Begins the reason of a loss: nothing is damaged, but the end of the recording is missing."""


try:  # ten times as fast
    from yaml import CSafeDumper as SafeDumper
except ImportError:  # PyYAML was built without libyaml
    from yaml import SafeDumper

METADATA_FILE = 'metadata.yaml'

LOST_KEY = 'mlmem_ros.lost'
"""Our key in the custom data of a repaired bag."""

_NEVER_NS = 2**63 - 1  # the starting time of a bag or file that holds no message
_MAX_METADATA_CHARS = 2**18  # characters: metadata of 400 topics


def format_qos(reliability: str = 'reliable', durability: str = 'volatile') -> str:
    """Return the QoS of one publisher with unlimited durations.

    History and depth are ``unknown`` and 0, as ``ros2 bag record`` writes them: discovery does
    not carry them.
    """
    return f"""\
- history: unknown
  depth: 0
  reliability: {reliability}
  durability: {durability}
  deadline:
    sec: 9223372036
    nsec: 854775807
  lifespan:
    sec: 9223372036
    nsec: 854775807
  liveliness: automatic
  liveliness_lease_duration:
    sec: 9223372036
    nsec: 854775807
  avoid_ros_namespace_conventions: false"""


@dataclass
class FileInfo:
    """One storage file of a bag. Times are in nanoseconds since the epoch, or of the ROS clock."""

    path: str
    starting_time: int = _NEVER_NS
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
        custom_data: What the recording application stored.
        compressed: Whether the files or messages are compressed as a whole.
    """

    files: tuple[str, ...] = ()
    message_counts: Mapping[str, int] = field(default_factory=dict)
    custom_data: Mapping[str, str] = field(default_factory=dict)
    compressed: bool = False

    @property
    def message_count(self) -> int:
        """Number of messages in the bag."""
        return sum(self.message_counts.values())


class _Dumper(SafeDumper):  # type: ignore[misc]
    def ignore_aliases(self, data: Any) -> bool:
        return True


def format_metadata(
    topics: Iterable[TopicInfo], files: Sequence[FileInfo], custom_data: Mapping[str, str]
) -> str:
    """Return the text of the ``metadata.yaml`` of a bag."""
    text: str = yaml.dump(
        {'rosbag2_bagfile_information': _build_node(topics, files, custom_data)},
        Dumper=_Dumper,
        sort_keys=False,
        allow_unicode=True,
        width=2**31 - 1,  # no line is broken
    )
    return text.rstrip('\n')


def parse_metadata(text: str) -> BagMetadata:
    """Read the metadata of any rosbag2 version: YAML text with or without the root key.

    Raises:
        BagError: The text is not rosbag2 metadata.
    """
    try:
        if len(text) > _MAX_METADATA_CHARS:
            raise ValueError(f'{len(text)} characters')
        # Every scalar stays a string: rosbag2 leaves the custom data ``seed: 42`` unquoted.
        document: Any = parse_yaml(text, texts=True)
        node = document.get('rosbag2_bagfile_information', document)
        custom_data = node.get('custom_data')
        return BagMetadata(
            # rosbag2 before version 4 wrote the directory's name too.
            files=tuple(
                PurePath(_require_text(path)).name for path in node['relative_file_paths'] or ()
            ),
            message_counts={
                _require_text(topic['topic_metadata']['name']): int(topic['message_count'])
                for topic in node['topics_with_message_count'] or ()
            },
            custom_data={
                _require_text(key): _require_text(value) for key, value in custom_data.items()
            }
            if isinstance(custom_data, dict)
            else {},
            compressed=_require_text(node.get('compression_mode', '')).lower() not in {'', 'none'},
        )
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise BagError(f'The text must be rosbag2 metadata; got {short_repr(text)}.') from error


def read_metadata_text(directory: Path) -> str | None:
    """Return the text of ``metadata.yaml``; None when there is none (``ros2 bag record`` writes it
    last).

    Raises:
        BagError: The file cannot be read.
    """
    path = directory / METADATA_FILE
    with storage_errors(f'read {path}'):
        if not atomic_files.path_exists(path):
            return None
        require_regular(path)
        with path.open('rb') as file:
            return file.read(4 * _MAX_METADATA_CHARS + 1).decode('utf-8', errors='replace')


def _build_node(
    topics: Iterable[TopicInfo], files: Sequence[FileInfo], custom_data: Mapping[str, str]
) -> dict[str, Any]:
    filled = [file for file in files if file.message_count]
    start = min((file.starting_time for file in filled), default=_NEVER_NS)
    end = max((file.starting_time + file.duration for file in filled), default=start)
    return {
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
                    'serialization_format': topic.serialization_format,
                    'offered_qos_profiles': _load_profiles(topic.offered_qos),
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
        # rosbag2 leaves an empty map undefined, which yaml-cpp writes as null.
        'custom_data': dict(custom_data) or None,
        'ros_distro': 'jazzy',
    }


@lru_cache  # most topics offer the same
def _load_profiles(text: str) -> Any:
    try:
        return yaml.safe_load(text) or []
    except yaml.YAMLError:  # of a damaged bag; messages do not need it
        return []


def _require_text(value: object) -> str:
    # Nested lists of aliases expand without bound when written out.
    if not isinstance(value, str):
        raise ValueError(f'got {short_repr(value)} for a text')
    return value
