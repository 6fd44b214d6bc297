# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Read a bag, whichever recorder wrote it and however the recording ended."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .contents import Loss, Message
from .definitions import Codec, Definition, codec_of
from .errors import BagError, storage_errors
from .mcap_source import McapSource
from .metadata import FILE_NAME, BagMetadata, TopicInfo, parse_metadata, read_metadata

if TYPE_CHECKING:
    from .rosbags_source import RosbagsSource


class BagReader:
    """Reads a bag directory, a single ``.mcap`` file or a single ``.db3`` file.

    Opening the bag reads all of it once, a few chunks at a time; after that `topics` and `losses`
    are exact. Whatever cannot be read is left out and listed in `losses`.
    """

    def __init__(self, path: str | PathLike[str]) -> None:
        """Open a bag.

        Args:
            path: The bag.

        Raises:
            BagError: There is no bag at the path, or nothing in it can be read.
        """
        self.path = Path(path)
        with storage_errors(f'read {self.path}'):
            if not self.path.exists():
                raise BagError(f'{self.path} must be a bag directory or file; it does not exist.')
            directory = self.path.is_dir()
        self._losses: list[Loss] = []
        self._codecs: dict[str, Codec] = {}
        metadata = self._read_metadata() if directory else None
        with storage_errors(f'read {self.path}'):
            files = self._listed(metadata) or self._found() if directory else [self.path]
        self._source = self._open(files, metadata)
        if metadata is None:
            metadata = _parsed(self._source.metadata_text)
        self.metadata = metadata
        """The last metadata the recorder wrote; None when it wrote none."""

    def __iter__(self) -> Iterator[Message]:
        return self.messages()

    @property
    def topics(self) -> Mapping[str, TopicInfo]:
        """The topics by name, with the number of messages that can be read."""
        return self._source.topics

    @property
    def losses(self) -> tuple[Loss, ...]:
        """What cannot be read; empty for an intact bag."""
        return (*self._losses, *self._source.losses)

    @property
    def message_count(self) -> int:
        """Number of messages that can be read."""
        return sum(info.message_count for info in self.topics.values())

    @property
    def span(self) -> tuple[int, int] | None:
        """Earliest and latest log time in nanoseconds, or None without messages."""
        return self._source.span

    @property
    def custom_data(self) -> Mapping[str, str]:
        """What the recording application stored besides the messages."""
        return self.metadata.custom_data if self.metadata else {}

    def messages(self, topics: Collection[str] | None = None) -> Iterator[Message]:
        """Read messages in the order of their log times, across all files.

        Args:
            topics: Names of the wanted topics; all by default. Unknown names are ignored.

        Yields:
            Messages; those with equal log times in the order they were written.

        Raises:
            BagError: The bag has changed since it was opened.
        """
        return self._source.messages(self.topics if topics is None else set(topics))

    def definition(self, type_name: str) -> Definition:
        """Return the definition of a type as the bag holds it.

        Args:
            type_name: Name of the type.

        Returns:
            The definition; without text and encoding if the bag holds none.
        """
        found = (item for item in self._source.definitions if item.type == type_name)
        definition = next(found, Definition(type_name, '', ''))
        hashes = (item for item in self.topics.values() if item.type == type_name)
        digest = next((item.type_description_hash for item in hashes), '')
        return Definition(type_name, definition.text, definition.encoding, digest)

    def deserialize(self, message: Message) -> Any:
        """Decode a message, by Jazzy's definition where it has one, else by that in the bag.

        A definition is parsed with the first message of its type; see `codec_of` for which are
        accepted.

        Args:
            message: A message of this bag.

        Returns:
            An object with the fields as attributes; arrays of numbers are numpy arrays.

        Raises:
            BagError: The type is unknown or rejected, or the bytes are not a message of it.
        """
        codec = self._codecs.get(message.type)
        if codec is None:
            codec = self._codecs[message.type] = codec_of([self.definition(message.type)])
        return codec.deserialize(message.cdr, message.type)

    def _read_metadata(self) -> BagMetadata | None:
        try:
            return read_metadata(self.path)
        except BagError as error:
            file = self.path / FILE_NAME
            size = file.stat().st_size if file.is_file() else 0
            self._losses.append(Loss(file, 0, size, str(error)))
            return None

    def _listed(self, metadata: BagMetadata | None) -> list[Path]:
        # rosbag2 before version 4 wrote the directory's name too.
        names = metadata.relative_file_paths if metadata else ()
        return [self.path / Path(name).name for name in names]

    def _found(self) -> list[Path]:
        for suffix in ('.mcap', '.db3'):
            files = [file for file in self.path.iterdir() if file.suffix == suffix]
            if files:
                return sorted(files, key=_natural_order)
        raise BagError(f'{self.path} must be a bag; it has no {FILE_NAME}, .mcap or .db3 file.')

    def _open(self, files: list[Path], metadata: BagMetadata | None) -> McapSource | RosbagsSource:
        compressed = metadata is not None and metadata.compression_mode.lower() not in {'', 'none'}
        if not compressed and files[0].suffix != '.db3':
            return McapSource(files)
        from .rosbags_source import RosbagsSource

        return RosbagsSource([self.path] if compressed else files)


def _parsed(text: str | None) -> BagMetadata | None:
    try:
        return None if text is None else parse_metadata(text)
    except BagError:
        return None  # a copy for readers without metadata.yaml; the messages do not need it


def _natural_order(path: Path) -> list[str | int]:
    # NAME_10 comes after NAME_9.
    return [int(part) if part.isdigit() else part for part in re.split('([0-9]+)', path.name)]
