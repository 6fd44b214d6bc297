# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reading one MCAP file as far as it can be read, be it whole, cut off or damaged.

The records are walked from the front, in the order they were written, and each chunk is checked
by its CRC. No index and no summary is needed or trusted, for a killed recorder leaves neither. A
chunk is taken whole or not at all: the start of a damaged one may look right and be wrong.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

from mcap.opcode import Opcode
from mcap.records import Channel, Metadata, Schema
from mcap.writer import MCAP0_MAGIC

from .contents import Loss
from .errors import BagError, storage_errors
from .mcap_file import METADATA_NAME
from .mcap_records import (
    HEAD_SIZE,
    DamageError,
    find_chunk,
    parse,
    parse_message,
    read_head,
    records,
    unpack_chunk,
)

_RUN_SIZE = 1 << 20  # bytes of messages outside chunks that make up one block
_READ = {
    Opcode.SCHEMA,
    Opcode.CHANNEL,
    Opcode.MESSAGE,
    Opcode.CHUNK,
    Opcode.METADATA,
}


@dataclass
class Block:
    """Messages that lie together in a file: a chunk, or a run of messages outside chunks.

    Attributes:
        offset: Where the block begins in the file, in bytes.
        size: Its length in the file, in bytes.
        chunked: Whether it is one chunk.
        start: Earliest log time, in nanoseconds.
        end: Latest log time, in nanoseconds.
        counts: Number of messages of each channel.
    """

    offset: int
    size: int
    chunked: bool
    start: int = 2**64
    end: int = 0
    counts: Counter[int] = field(default_factory=Counter)

    def add(self, channel: int, log_time: int) -> None:
        """Count a message.

        Args:
            channel: Id of its channel.
            log_time: Its log time in nanoseconds.
        """
        self.start = min(self.start, log_time)
        self.end = max(self.end, log_time)
        self.counts[channel] += 1


class McapScan:
    """What one MCAP file holds.

    Attributes:
        path: The file.
        schemas: Message types by id.
        channels: Channels by id.
        blocks: Where the messages are, in order of the file.
        metadata: The metadata record that rosbag2 wrote last, as text; None without one.
        losses: What could not be read.
    """

    def __init__(self, path: Path) -> None:
        """Walk through the file.

        Args:
            path: The file.

        Raises:
            BagError: The file cannot be opened or is not an MCAP file.
        """
        self.path = path
        self.schemas: dict[int, Schema] = {}
        self.channels: dict[int, Channel] = {}
        self.blocks: list[Block] = []
        self.metadata: str | None = None
        self.losses: list[Loss] = []
        self._data_ended = False
        with storage_errors(f'read {path}'), path.open('rb') as stream:
            self._size = stream.seek(0, 2)
            stream.seek(0)
            magic = stream.read(len(MCAP0_MAGIC))
            if not MCAP0_MAGIC.startswith(magic):
                raise BagError(f'{path} must be an MCAP file; it begins with {magic!r}.')
            if magic != MCAP0_MAGIC:
                self._lose(0, self._size, 'the file ends before its first record')
            else:
                self._walk(stream)
        self._tell_unknown_channels()

    def messages(
        self, block: Block, channels: Collection[int]
    ) -> Iterator[tuple[int, int, int, bytes]]:
        """Read the messages of a block.

        Args:
            block: One of `blocks`.
            channels: Ids of the channels wanted.

        Yields:
            Channel id, log time, publish time and data.

        Raises:
            BagError: The file has changed since it was scanned.
        """
        with storage_errors(f'read {self.path}'), self.path.open('rb') as stream:
            stream.seek(block.offset)
            content = memoryview(stream.read(block.size))
        try:
            if block.chunked:
                content = unpack_chunk(content[HEAD_SIZE:])
            for opcode, record in records(content):
                if opcode == Opcode.MESSAGE:
                    channel, log_time, publish_time, data = parse_message(record)
                    if channel in channels:
                        yield channel, log_time, publish_time, bytes(data)
        except DamageError as damage:
            raise BagError(f'{self.path} must not change while it is read: {damage}.') from damage

    def _walk(self, stream: BinaryIO) -> None:
        offset = len(MCAP0_MAGIC)
        while offset < self._size:
            try:
                opcode, end = read_head(stream, offset, self._size)
            except DamageError as damage:
                offset = self._skip(stream, offset, str(damage))
                continue
            if opcode in _READ:
                content = memoryview(stream.read(end - offset - HEAD_SIZE))
                try:
                    self._take(opcode, content, offset)
                except DamageError as damage:
                    self._lose(offset, end - offset, f'the record is damaged: {damage}')
            elif opcode == Opcode.DATA_END:
                self._data_ended = True
            elif opcode == Opcode.FOOTER:
                self._check_end(stream, end)
                return
            offset = end
        if not self.losses or self.losses[-1].offset + self.losses[-1].size < self._size:
            self._lose(self._size, 0, 'the file was not closed')

    def _take(self, opcode: int, content: memoryview, offset: int) -> None:
        if opcode == Opcode.SCHEMA:
            schema = parse(Schema, content)
            self.schemas[schema.id] = schema
        elif opcode == Opcode.CHANNEL:
            channel = parse(Channel, content)
            self.channels[channel.id] = channel
        elif opcode == Opcode.METADATA:
            record = parse(Metadata, content)
            if record.name == METADATA_NAME:
                self.metadata = record.metadata.get('serialized_metadata', self.metadata)
        elif opcode == Opcode.MESSAGE:
            self._take_message(content, offset)
        else:
            self._take_chunk(content, offset)

    def _take_message(self, content: memoryview, offset: int) -> None:
        channel, log_time, _, _ = parse_message(content)
        run = self.blocks[-1] if self.blocks else None
        if run is None or run.chunked or run.offset + run.size != offset or run.size > _RUN_SIZE:
            run = Block(offset, 0, chunked=False)
            self.blocks.append(run)
        run.size += HEAD_SIZE + len(content)
        run.add(channel, log_time)

    def _take_chunk(self, content: memoryview, offset: int) -> None:
        block = Block(offset, HEAD_SIZE + len(content), chunked=True)
        schemas: dict[int, Schema] = {}
        channels: dict[int, Channel] = {}
        for opcode, record in records(unpack_chunk(content)):
            if opcode == Opcode.MESSAGE:
                channel_id, log_time, _, _ = parse_message(record)
                block.add(channel_id, log_time)
            elif opcode == Opcode.SCHEMA:
                schema = parse(Schema, record)
                schemas[schema.id] = schema
            elif opcode == Opcode.CHANNEL:
                channel = parse(Channel, record)
                channels[channel.id] = channel
        self.schemas.update(schemas)
        self.channels.update(channels)
        if block.counts:
            self.blocks.append(block)

    def _skip(self, stream: BinaryIO, offset: int, reason: str) -> int:
        end = find_chunk(stream, offset + 1, self._size) or self._size
        self._lose(offset, end - offset, reason)
        return end

    def _check_end(self, stream: BinaryIO, offset: int) -> None:
        stream.seek(offset)
        if stream.read() != MCAP0_MAGIC:
            self._lose(offset, self._size - offset, 'the end of the file is not as it should be')

    def _lose(self, offset: int, size: int, reason: str) -> None:
        if self._data_ended:
            reason += '; all messages come before'
        self.losses.append(Loss(self.path, offset, size, reason))

    def _tell_unknown_channels(self) -> None:
        for block in self.blocks:
            unknown = sum(
                count for channel, count in block.counts.items() if channel not in self.channels
            )
            if unknown:
                self.losses.append(
                    Loss(
                        self.path,
                        block.offset,
                        0,
                        f'{unknown} messages are of channels whose definition is lost',
                    )
                )
