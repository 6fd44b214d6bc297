# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Read a bag, whichever recorder wrote it and however the recording ended."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any

from mlmem.parsing import require_regular
from mlmem.schema import short_repr

from . import jazzy
from .contents import BagMetadata, Loss, Message, TopicInfo, read_metadata
from .errors import BagError, storage_errors
from .mcap_part import McapPart


class BagReader:
    """Reads a bag directory, or a single ``.mcap`` file.

    Opening the bag reads all of it once, one chunk at a time; after that `topics` and `losses`
    are exact. Whatever cannot be read is left out and listed in `losses`.
    """

    def __init__(self, path: str | PathLike[str]) -> None:
        """Open a bag.

        Raises:
            BagError: There is no bag at the path, or nothing in it can be read.
        """
        self.path = Path(path)
        with storage_errors(f'read {self.path}'):
            if not self.path.exists():
                raise BagError(f'{self.path} must be a bag directory or file; it does not exist.')
            directory = self.path.is_dir()
        self._losses: list[Loss] = []
        self.metadata = metadata = self._read_metadata() if directory else None
        """What ``metadata.yaml`` says, or None without one that can be read."""
        with storage_errors(f'read {self.path}'):
            self._parts = self._open_parts(
                self._find_files(metadata) if directory else [self.path], metadata
            )
        self._parts_before_gap = len(self._parts)
        self.missing_parts = self._find_missing_parts(metadata)
        """Numbers, from 0, of the files that this bag should have and has not."""
        self.topics: dict[str, TopicInfo] = {}
        """The topics by name, with the number of messages that can be read."""
        for part in self._parts:
            for name, info in part.topics.items():
                known = self.topics.setdefault(name, replace(info, message_count=0))
                known.message_count += info.message_count

    def __iter__(self) -> Iterator[Message]:
        """Read all messages in the order in which they were written, across all files.

        Raises:
            BagError: The bag has changed since it was opened.
        """
        for part in self._parts:
            yield from part.messages(self.topics)

    @property
    def losses(self) -> tuple[Loss, ...]:
        """What cannot be read; empty for an intact bag."""
        return (*self._losses, *(loss for part in self._parts for loss in part.losses))

    @property
    def message_count(self) -> int:
        """Number of messages that can be read."""
        return sum(info.message_count for info in self.topics.values())

    @property
    def span(self) -> tuple[int, int] | None:
        """Earliest and latest log time in nanoseconds, or None without messages."""
        spans = [part.span for part in self._parts if part.span]
        if not spans:
            return None
        return min(start for start, _ in spans), max(end for _, end in spans)

    def session_messages(self, topics: Collection[str]) -> Iterator[Message]:
        """Read the messages of some topics, of which it may lack some, up to the first missing
        file.
        """
        for part in self._parts[: self._parts_before_gap]:
            yield from part.messages(topics)

    def deserialize(self, message: Message) -> Any:
        """Decode a message of this bag; see `jazzy.deserialize_message`.

        Raises:
            BagError: Its type does not ship with ROS 2 Jazzy, or is another one in this bag, or
                the bytes are not a message of it.
        """
        digest = self.topics[message.topic].type_hash
        if digest and digest != jazzy.find_definition(message.type).hash:
            raise BagError(
                f'{message.topic} must have the {message.type} of ROS 2 Jazzy; '
                f'got another one, {short_repr(digest)}.'
            )
        return jazzy.deserialize_message(message.cdr, message.type)

    def _read_metadata(self) -> BagMetadata | None:
        try:
            return read_metadata(self.path)
        except BagError as error:
            self._losses.append(Loss.of(self.path / 'metadata.yaml', error))
            return None

    def _find_files(self, metadata: BagMetadata | None) -> list[Path]:
        listed = [self.path / name for name in metadata.files] if metadata else []
        if any(file.is_file() for file in listed):
            return listed
        for suffix in ('.mcap', '.db3'):
            files = [file for file in self.path.iterdir() if file.suffix == suffix]
            if files:
                return sorted(files, key=_natural_order)
        raise BagError(f'{self.path} must be a bag; it has no metadata.yaml and no .mcap file.')

    def _open_parts(self, files: list[Path], metadata: BagMetadata | None) -> list[McapPart]:
        """Open the files; raise the first error if none can be read."""
        if (metadata is not None and metadata.compressed) or files[0].suffix == '.db3':
            raise BagError(
                f'{self.path} must be MCAP that is not compressed as a whole: `ros2 bag convert` '
                'makes such a bag of it',
                'other_storage',
            )
        parts, errors = [], []
        for file in files:
            try:
                with storage_errors(f'read {file}'):
                    require_regular(file)
                parts.append(McapPart(file))
            except BagError as error:
                errors.append(error)
                self._losses.append(Loss.of(file, error))
        if not parts:
            raise errors[0]
        return parts

    def _find_missing_parts(self, metadata: BagMetadata | None) -> tuple[int, ...]:
        """Return the numbers of missing files of a bag that we wrote, and list them as lost."""
        known = [part.number for part in self._parts if part.number is not None]
        if len(known) < len(self._parts):
            return ()
        listed = len(metadata.files) if metadata else 0  # each is opened, or lost
        count = max(*known, listed - 1) + 1
        missing = tuple(number for number in range(count) if number not in known)
        for number in missing:
            if number >= listed:
                until = '; a session is read up to there' if number > known[0] else ''
                reason = f'part {number + 1} of {count} is missing{until}'
                self._losses.append(Loss(self.path, 0, 0, reason))
        gaps = [n for n, number in enumerate(known) if number != known[0] + n]
        self._parts_before_gap = min(gaps, default=len(known))
        return missing


def _natural_order(path: Path) -> list[str | int]:
    # NAME_10 comes after NAME_9.
    return [int(part) if part.isdigit() else part for part in re.split('([0-9]+)', path.name)]
