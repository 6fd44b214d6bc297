# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One MCAP file, written by `mcap` so that all synced data survives the writer's death."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import IO, cast

from mcap.writer import LIBRARY_IDENTIFIER, IndexType, Writer

from .. import durable
from .contents import Definition
from .errors import BagError, storage_errors

LIBRARY = 'mlmem_ros'
"""Begins the name of the program in our files."""

METADATA_NAME = 'rosbag2'
"""Name of the MCAP metadata record in which rosbag2 keeps its metadata."""

CHUNK_SIZE = 256 * 1024
"""Bytes in a chunk, before compression; small, because damage loses a whole chunk."""


def check_library() -> None:
    """Raise a `BagError` if `mcap` is too old to sync."""
    if not hasattr(Writer, 'flush'):
        raise BagError('Recording needs mcap 1.6 or later: python3 -m pip install --upgrade mcap')


class McapFile:
    """A new MCAP file of profile ``ros2``: chunks with CRC, indexes, statistics, summary.

    Every method raises `BagError` if the disk is full or fails, or if the file was deleted; after
    that only `abandon` is of use.
    """

    def __init__(self, path: Path) -> None:
        """Create the file, where there must be none."""
        self.path = path
        self._schemas: dict[Definition, int] = {}
        with storage_errors(f'create {path}'):
            self._file = durable.create(path)
        self._writer = Writer(
            cast('IO[bytes]', self._file),
            chunk_size=CHUNK_SIZE,
            index_types=IndexType.CHUNK | IndexType.MESSAGE | IndexType.METADATA,
            enable_data_crcs=True,
        )
        try:
            with storage_errors(f'write {path}'):
                self._writer.start('ros2', f'{LIBRARY} {LIBRARY_IDENTIFIER}')
        except BagError:
            self.abandon()
            raise

    @property
    def size(self) -> int:
        """Bytes written, without the open chunk."""
        return self._file.tell()

    def add_channel(
        self,
        topic: str,
        definition: Definition,
        serialization_format: str,
        metadata: Mapping[str, str],
    ) -> int:
        """Declare a channel, and return its id; it is written with the first chunk that follows,
        its type once for all that share it.
        """
        with storage_errors(f'write {self.path}'):
            if definition not in self._schemas:
                self._schemas[definition] = self._writer.register_schema(
                    definition.type, definition.encoding, definition.text.encode()
                )
            return self._writer.register_channel(
                topic, serialization_format, self._schemas[definition], dict(metadata)
            )

    def write(self, channel: int, data: bytes, log_time: int, publish_time: int) -> None:
        """Append a message of a channel to the open chunk; times are in nanoseconds."""
        with storage_errors(f'write {self.path}'):
            self._writer.add_message(channel, log_time, data, publish_time)

    def write_metadata(self, text: str) -> None:
        """Append rosbag2's metadata record, YAML text."""
        with storage_errors(f'write {self.path}'):
            self._writer.add_metadata(METADATA_NAME, {'serialized_metadata': text})

    def sync(self) -> None:
        """Finish the open chunk and wait until everything written is on the disk."""
        self._sync_after(self._writer.flush)

    def close(self) -> None:
        """Finish the file with its summary and make it durable."""
        self._sync_after(self._writer.finish)
        with storage_errors(f'close {self.path}'):
            self._file.close()

    def abandon(self) -> None:
        """Close the file as it is, after an error."""
        durable.close_quietly(self._file)

    def _sync_after(self, finish: Callable[[], object]) -> None:
        with storage_errors(f'write {self.path}'):
            finish()
            self._file.sync()
            if self._file.deleted:
                raise BagError(f'Cannot write {self.path}: it was deleted while being written.')
