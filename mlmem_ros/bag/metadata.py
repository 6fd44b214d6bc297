# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""rosbag2's ``metadata.yaml``, version 9, as Jazzy writes it, by PyYAML."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..clipped import clipped
from ..durable import write_atomically
from .errors import BagError, storage_errors
from .qos import QosProfile, parse_profiles, profiles_of
from .yaml_text import Node, dump, load

FILE_NAME = 'metadata.yaml'
ROS_DISTRO = 'jazzy'
NEVER = 2**63 - 1
"""The starting time, in nanoseconds, of a bag or file that holds no message."""

_ROOT = 'rosbag2_bagfile_information'


@dataclass(frozen=True)
class TopicInfo:
    """One topic as ``metadata.yaml`` lists it."""

    name: str
    type: str
    serialization_format: str = 'cdr'
    offered_qos_profiles: tuple[QosProfile, ...] = ()
    type_description_hash: str = ''
    message_count: int = 0


@dataclass
class FileInfo:
    """One storage file of a bag. Times are in nanoseconds since the epoch, or of the ROS clock."""

    path: str
    starting_time: int = NEVER
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
    """What ``ros2 bag info`` shows. Times are in nanoseconds.

    Raises:
        BagError: Custom data holds something other than strings.
    """

    topics: tuple[TopicInfo, ...] = ()
    files: tuple[FileInfo, ...] = ()
    relative_file_paths: tuple[str, ...] = ()
    starting_time: int = NEVER
    duration: int = 0
    message_count: int = 0
    custom_data: Mapping[str, str] = field(default_factory=dict)
    ros_distro: str = ROS_DISTRO
    storage_identifier: str = 'mcap'
    compression_format: str = ''
    compression_mode: str = ''
    version: int = 9

    def __post_init__(self) -> None:
        for key, value in self.custom_data.items():
            if not isinstance(key, str) or not isinstance(value, str):
                raise BagError(
                    f'custom_data must map strings to strings; got {key!r:.80}: {value!r:.80}.'
                )

    @classmethod
    def of(
        cls, topics: Iterable[TopicInfo], files: Sequence[FileInfo], custom_data: Mapping[str, str]
    ) -> BagMetadata:
        """Describe a bag by its topics and files; raises as the class does."""
        filled = [file for file in files if file.message_count]
        start = min((file.starting_time for file in filled), default=NEVER)
        end = max((file.starting_time + file.duration for file in filled), default=start)
        return cls(
            topics=tuple(topics),
            files=tuple(files),
            relative_file_paths=tuple(file.path for file in files),
            starting_time=start,
            duration=end - start,
            message_count=sum(file.message_count for file in files),
            custom_data=dict(custom_data),
        )

    def text(self) -> str:
        """Return the content of ``metadata.yaml``."""
        return dump({_ROOT: self._node()})

    def record_text(self) -> str:
        """Return the text of the MCAP metadata record ``rosbag2``: the same without the root."""
        return dump(self._node())

    def write(self, directory: Path) -> None:
        """Write or renew ``metadata.yaml``, atomically and durably.

        Args:
            directory: The bag.

        Raises:
            BagError: The directory is gone, full or not writable.
        """
        path = directory / FILE_NAME
        with storage_errors(f'write {path}'):
            write_atomically(path, self.text())

    def _node(self) -> Node:
        return {
            'version': self.version,
            'storage_identifier': self.storage_identifier,
            'duration': {'nanoseconds': self.duration},
            'starting_time': {'nanoseconds_since_epoch': self.starting_time},
            'message_count': self.message_count,
            'topics_with_message_count': [_topic_node(topic) for topic in self.topics],
            'compression_format': self.compression_format,
            'compression_mode': self.compression_mode,
            'relative_file_paths': self.relative_file_paths,
            'files': [_file_node(file) for file in self.files],
            # rosbag2 leaves an empty map undefined, which yaml-cpp writes as null.
            'custom_data': self.custom_data or None,
            'ros_distro': self.ros_distro,
        }


def parse_metadata(text: str) -> BagMetadata:
    """Read the metadata of any rosbag2 version, from a file or an MCAP record.

    Args:
        text: YAML text with or without the root key.

    Returns:
        The metadata; fields its version did not have yet get their defaults.

    Raises:
        BagError: The text is not rosbag2 metadata.
    """
    try:
        document: Any = load(text)
        return _metadata(document.get(_ROOT, document))
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise BagError(f'The text must be rosbag2 metadata; got {clipped(text)}.') from error


def read_metadata(directory: Path) -> BagMetadata | None:
    """Read ``metadata.yaml`` of a bag.

    Args:
        directory: The bag.

    Returns:
        The metadata, or None when the bag has none (``ros2 bag record`` writes it last).

    Raises:
        BagError: The file cannot be read or is not rosbag2 metadata.
    """
    path = directory / FILE_NAME
    with storage_errors(f'read {path}'):
        if not path.exists():
            return None
        text = path.read_bytes().decode('utf-8', errors='replace')
    return parse_metadata(text)


def _topic_node(topic: TopicInfo) -> Node:
    return {
        'topic_metadata': {
            'name': topic.name,
            'type': topic.type,
            'serialization_format': topic.serialization_format,
            'offered_qos_profiles': [profile.node() for profile in topic.offered_qos_profiles],
            'type_description_hash': topic.type_description_hash,
        },
        'message_count': topic.message_count,
    }


def _file_node(file: FileInfo) -> Node:
    return {
        'path': file.path,
        'starting_time': {'nanoseconds_since_epoch': file.starting_time},
        'duration': {'nanoseconds': file.duration},
        'message_count': file.message_count,
    }


def _metadata(node: dict[str, Any]) -> BagMetadata:
    custom_data = node.get('custom_data')
    return BagMetadata(
        topics=tuple(_topic(item) for item in node['topics_with_message_count'] or ()),
        files=tuple(_file(item) for item in node.get('files') or ()),
        relative_file_paths=tuple(_text(path) for path in node['relative_file_paths'] or ()),
        starting_time=int(node['starting_time']['nanoseconds_since_epoch']),
        duration=int(node['duration']['nanoseconds']),
        message_count=int(node['message_count']),
        custom_data=_texts(custom_data) if isinstance(custom_data, dict) else {},
        ros_distro=_text(node.get('ros_distro', '')),
        storage_identifier=_text(node['storage_identifier']),
        compression_format=_text(node.get('compression_format', '')),
        compression_mode=_text(node.get('compression_mode', '')),
        version=int(node['version']),
    )


def _topic(item: dict[str, Any]) -> TopicInfo:
    topic = item['topic_metadata']
    profiles = topic.get('offered_qos_profiles', '')
    return TopicInfo(
        name=_text(topic['name']),
        type=_text(topic['type']),
        serialization_format=_text(topic['serialization_format']),
        # Before version 9 the profiles are YAML inside YAML.
        offered_qos_profiles=(
            parse_profiles(profiles) if isinstance(profiles, str) else profiles_of(profiles)
        ),
        type_description_hash=_text(topic.get('type_description_hash', '')),
        message_count=int(item['message_count']),
    )


def _file(item: dict[str, Any]) -> FileInfo:
    return FileInfo(
        path=_text(item['path']),
        starting_time=int(item['starting_time']['nanoseconds_since_epoch']),
        duration=int(item['duration']['nanoseconds']),
        message_count=int(item['message_count']),
    )


def _text(value: object) -> str:
    # Nested lists of aliases expand without bound when written out.
    if not isinstance(value, str):
        raise ValueError(f'got {clipped(value)} for a text')
    return value


def _texts(values: dict[object, object]) -> dict[str, str]:
    return {_text(key): _text(value) for key, value in values.items()}
