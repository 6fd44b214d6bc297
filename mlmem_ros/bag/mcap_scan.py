# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Read one MCAP file as far as possible, whether whole, truncated or damaged.

The records are read from the front, in the order they were written, and parsed by `mcap`; each
chunk is checked by its CRC. Indexes and summaries are neither needed nor trusted: a killed
recorder leaves none. A chunk is read whole or not at all: the start of a damaged one may look
right and be wrong. Nothing after a damaged length field is recovered.
"""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

import zstandard
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.writer import MCAP0_MAGIC

from ..clipped import printable
from .contents import Loss
from .errors import BagError, storage_errors
from .mcap_file import METADATA_NAME

_HEAD = struct.Struct('<BQ')  # opcode and length of a record
_READ = {Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE, Opcode.CHUNK, Opcode.METADATA}
_RUN_SIZE = 1 << 20  # bytes of messages outside chunks that make up one block
_LARGEST_CHUNK = 2**27  # bytes, uncompressed; a file of a megabyte must not fill the memory
_COMPRESSIONS = {'', 'lz4', 'zstd'}


class DamageError(Exception):
    """A record is not what it claims to be; the text says how."""


@dataclass
class Block:
    """Contiguous messages in a file: a chunk, or a run of messages outside chunks.

    Attributes:
        offset: Where the block begins in the file, in bytes.
        end: Where it ends.
        chunked: Whether it is one chunk.
        earliest: Earliest log time, in nanoseconds.
        latest: Latest log time, in nanoseconds.
        counts: Number of messages of each channel.
    """

    offset: int
    end: int
    chunked: bool
    earliest: int = 2**64
    latest: int = 0
    counts: Counter[int] = field(default_factory=Counter)


class McapScan:
    """What one MCAP file holds.

    Attributes:
        path: The file.
        schemas: Message types by id.
        channels: Channels by id.
        blocks: Where the messages are, in file order.
        metadata: The last metadata record that rosbag2 wrote, as text; None without one.
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
        with storage_errors(f'read {path}'), path.open('rb') as stream:
            magic = stream.read(len(MCAP0_MAGIC))
            if not MCAP0_MAGIC.startswith(magic):
                raise BagError(f'{path} must be an MCAP file; it begins with {magic!r}.')
            self._walk(stream)
        self._tell_unknown_channels()

    def messages(self, block: Block, channels: Collection[int]) -> Iterator[Message]:
        """Read the messages of a block.

        Args:
            block: One of `blocks`.
            channels: Ids of the wanted channels.

        Yields:
            The messages in block order.

        Raises:
            BagError: The file has changed since it was scanned.
        """
        with storage_errors(f'read {self.path}'), self.path.open('rb') as stream:
            stream.seek(block.offset)
            content = BytesIO(stream.read(block.end - block.offset))
        count = 0
        try:
            for _, offset, end in _spans(content, 0):
                for record in _parsed(content, offset, end):
                    if isinstance(record, Message):
                        count += 1
                        if record.channel_id in channels:
                            yield record
            if count != block.counts.total():
                raise DamageError(f'{count} of {block.counts.total()} messages remain')
        except DamageError as damage:
            raise BagError(f'{self.path} must not change while it is read: {damage}.') from damage

    def _walk(self, stream: BinaryIO) -> None:
        start = end = len(MCAP0_MAGIC)
        opcode, told = 0, ''
        for opcode, offset, end in _spans(stream, start):
            if opcode == Opcode.DATA_END:
                told = '; all messages precede it'
            elif opcode in _READ:
                try:
                    records = _parsed(stream, offset, end)
                except DamageError as damage:
                    reason = f'the record is damaged: {damage}{told}'
                    self.losses.append(Loss(self.path, offset, end - offset, reason))
                else:
                    self._take(records, offset, end, chunked=opcode == Opcode.CHUNK)
        size = stream.seek(0, 2)
        stream.seek(end)
        if opcode != Opcode.FOOTER or stream.read(len(MCAP0_MAGIC) + 1) != MCAP0_MAGIC:
            end = min(end, size)
            reason = 'it was truncated or damaged' if end < size else 'the file was not closed'
            self.losses.append(Loss(self.path, end, size - end, reason + told))

    def _take(self, records: list[McapRecord], offset: int, end: int, chunked: bool) -> None:
        for record in records:
            # The first definition stands: the summary, which repeats it, is not checked.
            if isinstance(record, Schema):
                self.schemas.setdefault(record.id, record)
            elif isinstance(record, Channel):
                self.channels.setdefault(record.id, record)
            elif isinstance(record, Metadata) and record.name == METADATA_NAME:
                self.metadata = record.metadata.get('serialized_metadata', self.metadata)
        found = [(m.channel_id, m.log_time) for m in records if isinstance(m, Message)]
        if not found:
            return
        run = self.blocks[-1] if self.blocks and not chunked else None
        if run is None or run.chunked or run.end != offset or end - run.offset > _RUN_SIZE:
            run = Block(offset, end, chunked)
            self.blocks.append(run)
        run.end = end
        run.counts.update(channel for channel, _ in found)
        run.earliest = min(run.earliest, *(time for _, time in found))
        run.latest = max(run.latest, *(time for _, time in found))

    def _tell_unknown_channels(self) -> None:
        for block in self.blocks:
            unknown = sum(n for channel, n in block.counts.items() if channel not in self.channels)
            if unknown:
                reason = f'{unknown} messages belong to channels whose definition is lost'
                self.losses.append(Loss(self.path, block.offset, 0, reason))


def _spans(stream: BinaryIO, offset: int) -> Iterator[tuple[int, int, int]]:
    """Yield opcode, begin and end of every record, up to a footer or an incomplete one."""
    size = stream.seek(0, 2)
    opcode = 0
    while opcode != Opcode.FOOTER:
        stream.seek(offset)
        head = stream.read(_HEAD.size)
        if len(head) < _HEAD.size:
            return
        opcode, length = _HEAD.unpack(head)
        end = offset + _HEAD.size + length
        if not opcode or end > size:  # some file systems leave zeros after a power cut
            return
        yield opcode, offset, end
        offset = end


def _parsed(stream: BinaryIO, offset: int, end: int) -> list[McapRecord]:
    """Return the record there, or those of a chunk; raise `DamageError`."""
    stream.seek(offset)
    content = BytesIO(stream.read(end - offset))
    try:
        record = next(StreamReader(content, skip_magic=True, emit_chunks=True).records)
        if not isinstance(record, Chunk):
            return [record]
        _check_claims(record)
        return breakup_chunk(record, validate_crc=True)
    except DamageError:
        raise
    except Exception as error:  # parsers and decompressors have no common error class
        raise DamageError(printable(str(error) or repr(error), 200)) from error


def _check_claims(chunk: Chunk) -> None:
    """Refuse a chunk that would exhaust memory: its claimed size would be allocated."""
    if chunk.compression not in _COMPRESSIONS:
        raise DamageError(f'its compression must be lz4 or zstd; got {chunk.compression!r}')
    claimed = chunk.uncompressed_size
    if chunk.compression == 'zstd':
        size = zstandard.get_frame_parameters(chunk.data).content_size
        claimed = max(claimed, 0 if size == zstandard.CONTENTSIZE_UNKNOWN else size)
    if claimed > _LARGEST_CHUNK:
        raise DamageError(
            f'it claims to hold {claimed} bytes; at most {_LARGEST_CHUNK} are accepted'
        )
