# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Writing one MCAP file so that all that was synced survives the death of the writer.

`mcap.writer.Writer` puts schemas and channels into the chunk that happens to be open. Should that
chunk be damaged and the summary be missing, every later message would be lost with them. Here
they stand outside, and the file is put together from mcap's public record classes.
"""

from __future__ import annotations

import zlib
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    ChunkIndex,
    DataEnd,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
)
from mcap.writer import LIBRARY_IDENTIFIER, MCAP0_MAGIC

from .. import durable
from .definitions import Definition
from .errors import BagError, storage_errors
from .mcap_chunk import ChunkBuilder
from .mcap_records import encode
from .mcap_summary import encode_summary

METADATA_NAME = 'rosbag2'
"""Name of the MCAP metadata record in which rosbag2 keeps its metadata."""

_CHUNK_SIZE = 256 * 1024  # bytes; small, for what is damaged is lost chunk by chunk


class McapFile:
    """A new MCAP file of profile ``ros2``: chunks with CRC, indexes, statistics, summary.

    Every method raises `BagError` when the file system refuses; the file is then of no more
    use except to `abandon` it.
    """

    def __init__(self, path: Path, compression: str) -> None:
        """Create the file.

        Args:
            path: Where; must not exist.
            compression: Compression of the chunks, ``'zstd'`` or ``'none'``.

        Raises:
            BagError: The file cannot be created.
        """
        self.path = path
        self._compression = compression
        self._offset = 0
        self._crc = 0
        self._chunk = ChunkBuilder()
        self._schemas: dict[Definition, Schema] = {}
        self._channels: list[Channel] = []
        self._chunk_indexes: list[ChunkIndex] = []
        self._metadata_indexes: list[MetadataIndex] = []
        self._counts: Counter[int] = Counter()
        with storage_errors(f'create {path}'):
            self._file = durable.create(path)
        try:
            self._write(MCAP0_MAGIC)
            self._write_record(Header('ros2', f'mlmem_ros {LIBRARY_IDENTIFIER}'))
        except BagError:
            self.abandon()
            raise

    @property
    def size(self) -> int:
        """Bytes written, plus those of the open chunk before compression."""
        return self._offset + self._chunk.size

    def add_channel(
        self,
        topic: str,
        definition: Definition,
        serialization_format: str,
        metadata: Mapping[str, str],
    ) -> int:
        """Declare a channel.

        Args:
            topic: Name of the topic.
            definition: Its message type; written once for all channels that share it.
            serialization_format: Encoding of the messages, such as ``cdr``.
            metadata: Metadata of the channel.

        Returns:
            The channel's id, for `write`.

        Raises:
            BagError: The declaration could not be written.
        """
        schema = self._schemas.get(definition)
        if schema is None:
            number = len(self._schemas) + 1
            text = definition.text.encode()
            schema = Schema(number, text, definition.encoding, definition.type)
            self._schemas[definition] = schema
            self._write_record(schema)
        number = len(self._channels) + 1
        channel = Channel(number, topic, serialization_format, dict(metadata), schema.id)
        self._channels.append(channel)
        self._write_record(channel)
        return number

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
        self._chunk.add(channel, data, log_time, publish_time)
        self._counts[channel] += 1
        if self._chunk.size >= _CHUNK_SIZE:
            self._finish_chunk()

    def write_metadata(self, text: str) -> None:
        """Append rosbag2's metadata record.

        Args:
            text: The bag's metadata as YAML.

        Raises:
            BagError: The record could not be written.
        """
        offset = self._offset
        length = self._write_record(Metadata(METADATA_NAME, {'serialized_metadata': text}))
        self._metadata_indexes.append(MetadataIndex(offset, length, METADATA_NAME))

    def sync(self) -> None:
        """Finish the open chunk and wait until the disk has all that was written.

        Raises:
            BagError: The disk is full, failed, or the file was deleted meanwhile.
        """
        self._finish_chunk()
        with storage_errors(f'write {self.path}'):
            self._file.sync()
            deleted = self._file.deleted
        if deleted:
            raise BagError(f'Cannot write {self.path}: it was deleted while being written.')

    def close(self) -> None:
        """Finish the file with its summary and make it durable.

        Raises:
            BagError: The disk is full, failed, or the file was deleted meanwhile.
        """
        self._finish_chunk()
        self._write_record(DataEnd(self._crc))
        self._write_summary()
        self._write(MCAP0_MAGIC)
        self.sync()
        with storage_errors(f'close {self.path}'):
            self._file.close()

    def abandon(self) -> None:
        """Let go of the file as it is, after an error."""
        durable.close_quietly(self._file)

    def _finish_chunk(self) -> None:
        if not self._chunk.size:
            return
        chunk, indexes = self._chunk.finish(self._compression)
        self._chunk = ChunkBuilder()
        start = self._offset
        length = self._write_record(chunk)
        offsets = {}
        for index in indexes:
            offsets[index.channel_id] = self._offset
            self._write_record(index)
        self._chunk_indexes.append(
            ChunkIndex(
                chunk_length=length,
                chunk_start_offset=start,
                compression=chunk.compression,
                compressed_size=len(chunk.data),
                message_end_time=chunk.message_end_time,
                message_index_length=self._offset - start - length,
                message_index_offsets=offsets,
                message_start_time=chunk.message_start_time,
                uncompressed_size=chunk.uncompressed_size,
            )
        )

    def _write_summary(self) -> None:
        groups: list[tuple[Opcode, Sequence[McapRecord]]] = [
            (Opcode.SCHEMA, list(self._schemas.values())),
            (Opcode.CHANNEL, self._channels),
            (Opcode.STATISTICS, [self._statistics()]),
            (Opcode.CHUNK_INDEX, self._chunk_indexes),
            (Opcode.METADATA_INDEX, self._metadata_indexes),
        ]
        self._write(encode_summary(self._offset, groups))

    def _statistics(self) -> Statistics:
        chunks = self._chunk_indexes
        return Statistics(
            attachment_count=0,
            channel_count=len(self._channels),
            channel_message_counts=dict(self._counts),
            chunk_count=len(chunks),
            message_count=self._counts.total(),
            message_end_time=max((chunk.message_end_time for chunk in chunks), default=0),
            message_start_time=min((chunk.message_start_time for chunk in chunks), default=0),
            metadata_count=len(self._metadata_indexes),
            schema_count=len(self._schemas),
        )

    def _write_record(self, record: McapRecord) -> int:
        return self._write(encode(record))

    def _write(self, content: bytes) -> int:
        with storage_errors(f'write {self.path}'):
            self._file.write(content)
        self._offset += len(content)
        self._crc = zlib.crc32(content, self._crc)
        return len(content)
