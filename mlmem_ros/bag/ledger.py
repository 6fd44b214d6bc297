# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Keeping count of a bag while it is written."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from .metadata import NEVER, BagMetadata, FileInfo, TopicInfo


@dataclass
class _Span:
    """Some messages: how many, from when to when in nanoseconds."""

    start: int = NEVER
    end: int = 0
    message_count: int = 0

    @property
    def duration(self) -> int:
        return max(0, self.end - self.start)

    def add(self, log_time: int) -> None:
        self.start = min(self.start, log_time)
        self.end = max(self.end, log_time)
        self.message_count += 1


class Ledger:
    """Which topics, files and messages a bag has so far."""

    def __init__(self, name: str) -> None:
        """Open the ledger of an empty bag.

        Args:
            name: Name of the bag, after which its files are named.
        """
        self._name = name
        self._topics: dict[str, TopicInfo] = {}
        self._counts: dict[str, int] = {}
        self._files: list[_Span] = []
        self._bag = _Span()

    @property
    def message_count(self) -> int:
        """Messages in the bag."""
        return self._bag.message_count

    @property
    def file_count(self) -> int:
        """Files of the bag."""
        return len(self._files)

    @property
    def file_message_count(self) -> int:
        """Messages in the newest file."""
        return self._files[-1].message_count

    @property
    def file_start(self) -> int:
        """Earliest log time in the newest file, in nanoseconds."""
        return self._files[-1].start

    def add_file(self) -> str:
        """Enter a new file; what is counted from now on is in it.

        Returns:
            The file's name.
        """
        self._files.append(_Span())
        return self._file_name(len(self._files) - 1)

    def add_topic(self, info: TopicInfo) -> None:
        """Enter a topic with no message yet.

        Args:
            info: The topic.
        """
        self._topics[info.name] = info
        self._counts[info.name] = 0

    def add_message(self, topic: str, log_time: int) -> None:
        """Count a message.

        Args:
            topic: Name of its topic.
            log_time: Its log time in nanoseconds.
        """
        self._counts[topic] += 1
        self._files[-1].add(log_time)
        self._bag.add(log_time)

    def metadata(self, custom_data: Mapping[str, str]) -> BagMetadata:
        """Describe the bag as it stands.

        Args:
            custom_data: What to tell beside the counts.

        Returns:
            The metadata rosbag2 would write.

        Raises:
            BagError: Custom data holds something else than strings.
        """
        files = tuple(
            FileInfo(self._file_name(number), span.start, span.duration, span.message_count)
            for number, span in enumerate(self._files)
        )
        return BagMetadata(
            topics=tuple(
                replace(info, message_count=self._counts[name])
                for name, info in self._topics.items()
            ),
            files=files,
            relative_file_paths=tuple(file.path for file in files),
            starting_time=self._bag.start,
            duration=self._bag.duration,
            message_count=self._bag.message_count,
            custom_data=dict(custom_data),
        )

    def _file_name(self, number: int) -> str:
        return f'{self._name}_{number}.mcap'
