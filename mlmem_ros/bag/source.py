# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What every kind of storage offers to the reader."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Protocol

from .contents import Loss, Message
from .definitions import Definition
from .metadata import TopicInfo


class Source(Protocol):
    """The messages of a bag, wherever and however it stores them."""

    @property
    def topics(self) -> Mapping[str, TopicInfo]:
        """The topics by name, with the number of messages that can be read."""

    @property
    def definitions(self) -> Sequence[Definition]:
        """The message definitions the bag holds."""

    @property
    def losses(self) -> Sequence[Loss]:
        """What cannot be read."""

    @property
    def span(self) -> tuple[int, int] | None:
        """Earliest and latest log time in nanoseconds, or None without messages."""

    @property
    def metadata_text(self) -> str | None:
        """rosbag2's metadata as the storage itself holds it, or None."""

    def messages(self, topics: Collection[str]) -> Iterator[Message]:
        """Read messages in the order of their log times.

        Args:
            topics: Names of the topics wanted.

        Yields:
            Messages; those of equal log time in the order they were written.

        Raises:
            BagError: The bag has changed since it was opened.
        """
