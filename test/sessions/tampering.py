# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A recorded session that a test changes before it is written again; its file stays whole."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from mlmem_ros.bag.contents import Message, TopicInfo
from mlmem_ros.bag.reader import BagReader
from mlmem_ros.bag.writer import BagWriter


@dataclass
class Tampered:
    """A session to be written."""

    topics: dict[str, TopicInfo]
    messages: list[Message]

    @classmethod
    def read(cls, path: Path) -> Tampered:
        """Return a session as it is, less the topics on which nothing was said."""
        reader = BagReader(path)
        topics = {name: info for name, info in reader.topics.items() if info.message_count}
        return cls(topics, list(reader))

    def write(self, path: Path) -> None:
        """Write it, whatever it holds, as a whole bag."""
        with BagWriter(path) as writer:
            for name, info in self.topics.items():
                writer.add_topic(name, info.type)
            for message in self.messages:
                writer.write(message.topic, message.cdr, message.log_time)
