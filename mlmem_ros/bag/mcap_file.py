# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One MCAP file, written by `mcap` so that all synced data survives the writer's death."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import IO, cast

from mcap.writer import LIBRARY_IDENTIFIER, CompressionType, IndexType, Writer

from .. import durable
from .definitions import Definition
from .errors import BagError, storage_errors

METADATA_NAME = 'rosbag2'
"""Name of the MCAP metadata record in which rosbag2 keeps its metadata."""

COMPRESSIONS = {'zstd': CompressionType.ZSTD, 'none': CompressionType.NONE}
"""Compressions that a chunk can have, by name."""

_CHUNK_SIZE = 256 * 1024  # bytes; small, because damage loses a whole chunk
_MESSAGE_HEAD = 31  # bytes of a message in addition to its data


def check_library() -> None:
    """Raise a `BagError` if `mcap` is too old to sync."""
    if not hasattr(Writer, 'flush'):
        raise BagError('Recording needs mcap 1.6 or later: python3 -m pip install --upgrade mcap')


class McapFile:
    """A new MCAP file of profile ``ros2``: chunks with CRC, indexes, statistics, summary.

    Every method raises `BagError` on a file system error; after that only `abandon` is of use.
    """

    def __init__(self, path: Path, compression: str) -> None:
        """Create the file.

        Args:
            path: Where; must not exist.
            compression: One of `COMPRESSIONS`.

        Raises:
            BagError: The file cannot be created.
        """
        self.path = path
        self._schemas: dict[Definition, int] = {}
        self._open_chunk = 0  # bytes
        with storage_errors(f'create {path}'):
            self._file = durable.create(path)
        self._writer = Writer(
            cast('IO[bytes]', self._file),
            chunk_size=_CHUNK_SIZE,
            compression=COMPRESSIONS[compression],
            index_types=IndexType.CHUNK | IndexType.MESSAGE | IndexType.METADATA,
            enable_data_crcs=True,
        )
        try:
            with storage_errors(f'write {path}'):
                self._writer.start('ros2', f'mlmem_ros {LIBRARY_IDENTIFIER}')
        except BagError:
            self.abandon()
            raise

    @property
    def size(self) -> int:
        """Bytes written, plus those of the open chunk before compression."""
        return self._file.tell() + self._open_chunk

    def add_channel(
        self,
        topic: str,
        definition: Definition,
        serialization_format: str,
        metadata: Mapping[str, str],
    ) -> int:
        """Declare a channel; it is written with the first chunk that follows.

        Args:
            topic: Name of the topic.
            definition: Its message type; written once for all channels that share it.
            serialization_format: Encoding of the messages, such as ``cdr``.
            metadata: Metadata of the channel.

        Returns:
            The channel's id, for `write`.

        Raises:
            BagError: The open chunk was full and could not be written.
        """
        with storage_errors(f'write {self.path}'):
            if definition not in self._schemas:
                text = definition.text.encode()
                self._schemas[definition] = self._writer.register_schema(
                    definition.type, definition.encoding, text
                )
                self._open_chunk += len(text)
            return self._writer.register_channel(
                topic, serialization_format, self._schemas[definition], dict(metadata)
            )

    def write(self, channel: int, data: bytes, log_time: int, publish_time: int) -> None:
        """Append a message to the open chunk.

        Args:
            channel: Id of its channel.
            data: The encoded message.
            log_time: When it was received, in nanoseconds.
            publish_time: When it was sent, in nanoseconds.

        Raises:
            BagError: The chunk was full and could not be written.
        """
        before = self._file.tell()
        with storage_errors(f'write {self.path}'):
            self._writer.add_message(channel, log_time, data, publish_time)
        self._open_chunk += _MESSAGE_HEAD + len(data)
        if self._file.tell() > before:
            self._open_chunk = 0

    def write_metadata(self, text: str) -> None:
        """Append rosbag2's metadata record.

        Args:
            text: The bag's metadata as YAML.

        Raises:
            BagError: The record could not be written.
        """
        with storage_errors(f'write {self.path}'):
            self._writer.add_metadata(METADATA_NAME, {'serialized_metadata': text})

    def sync(self) -> None:
        """Finish the open chunk and wait until everything written is on the disk.

        Raises:
            BagError: The disk is full, failed, or the file was deleted meanwhile.
        """
        with storage_errors(f'write {self.path}'):
            self._writer.flush()
        self._open_chunk = 0
        self._sync()

    def close(self) -> None:
        """Finish the file with its summary and make it durable.

        Raises:
            BagError: The disk is full, failed, or the file was deleted meanwhile.
        """
        with storage_errors(f'write {self.path}'):
            self._writer.finish()
        self._open_chunk = 0
        self._sync()
        with storage_errors(f'close {self.path}'):
            self._file.close()

    def abandon(self) -> None:
        """Close the file as it is, after an error."""
        durable.close_quietly(self._file)

    def _sync(self) -> None:
        with storage_errors(f'write {self.path}'):
            self._file.sync()
            deleted = self._file.deleted
        if deleted:
            raise BagError(f'Cannot write {self.path}: it was deleted while being written.')
