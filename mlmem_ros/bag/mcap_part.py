# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Read one MCAP file as far as possible, whether whole, truncated or damaged.

The records are read from the front, in the order they were written, and parsed by `mcap`; each
chunk is checked by its CRC, and so is the whole file if its recorder gave it one. No index or
summary is needed: a killed recorder leaves none. A chunk is read whole or not at all: the start of
a damaged one may look right and be wrong. Nothing after a damaged length field is recovered.
"""

from __future__ import annotations

import struct
import zlib
from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field, replace
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

import lz4.frame
import zstandard
from mcap import records
from mcap.opcode import Opcode
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.writer import MCAP0_MAGIC

from mlmem.schema import make_printable

from .contents import (
    LIBRARY_NAME,
    METADATA_NAME,
    NOT_CLOSED_REASON,
    OFFERED_QOS,
    TYPE_HASH,
    Definition,
    Loss,
    Message,
    TopicInfo,
    parse_metadata,
)
from .errors import BagError, storage_errors

_RECORD_HEAD = struct.Struct('<BQ')  # opcode and length of a record
_READ_OPCODES = {
    *(Opcode.HEADER, Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE, Opcode.CHUNK),
    *(Opcode.METADATA, Opcode.DATA_END, Opcode.FOOTER),
}
MAX_HELD_BYTES = 2**27
"""Most bytes that a chunk may take in memory, however small the file is."""

RECORD_BYTES = 600
"""Bytes that a record takes in memory in addition to its content."""

_MAX_DEFINITION_BYTES = 2**24
_MAX_RUN_BYTES = 1 << 20  # bytes of messages outside chunks that make up one block


class DamageError(Exception):
    """A record is damaged; the text says how."""


@dataclass
class Block:
    """Contiguous messages in a file: a chunk, or a run of messages outside chunks.

    Attributes:
        counts: Number of messages of each channel.
    """

    offset: int
    end: int
    chunked: bool
    earliest: int = 2**64
    latest: int = 0
    counts: Counter[int] = field(default_factory=Counter)


class McapPart:
    """What one MCAP file of a bag holds. A few chunks of it are in memory at a time.

    Attributes:
        schemas: Message types by id.
        channels: Channels by id.
        blocks: Where the messages are, in file order.
        metadata_text: The last metadata record that rosbag2 wrote; None without one.
        library: The program that wrote it.
    """

    def __init__(self, path: Path) -> None:
        """Walk through the file.

        Raises:
            BagError: The file cannot be opened or is not an MCAP file.
        """
        self.path = path
        self.schemas: dict[int, records.Schema] = {}
        self.channels: dict[int, records.Channel] = {}
        self.blocks: list[Block] = []
        self.metadata_text: str | None = None
        self.library = ''
        self.losses: list[Loss] = []
        self._definition_bytes = 0
        with storage_errors(f'read {path}'), path.open('rb') as stream:
            magic = stream.read(len(MCAP0_MAGIC))
            if not MCAP0_MAGIC.startswith(magic):
                raise BagError(f'{path} must be an MCAP file; it begins with {magic!r}.')
            self._walk(stream)
        self._find_unknown_channels()

    @property
    def number(self) -> int | None:
        """Its place among the files of its bag, from 0; None if another program wrote it."""
        if self.metadata_text is None or not self.library.startswith(LIBRARY_NAME):
            return None
        try:  # the copy of the metadata in a file lists the files up to it
            return len(parse_metadata(self.metadata_text).files) - 1
        except BagError:
            return None

    @property
    def span(self) -> tuple[int, int] | None:
        """Earliest and latest log time in nanoseconds, or None without messages."""
        if not self.blocks:
            return None
        return (
            min(block.earliest for block in self.blocks),
            max(block.latest for block in self.blocks),
        )

    @property
    def topics(self) -> Mapping[str, TopicInfo]:
        """The topics by name, with the number of messages that can be read."""
        counts = sum((block.counts for block in self.blocks), Counter[int]())
        topics: dict[str, TopicInfo] = {}
        for channel in self.channels.values():
            info = topics.get(channel.topic) or TopicInfo(
                name=channel.topic,
                type=self._find_type(channel),
                serialization_format=channel.message_encoding,
                offered_qos=channel.metadata.get(OFFERED_QOS, ''),
                type_hash=channel.metadata.get(TYPE_HASH, ''),
            )
            count = info.message_count + counts[channel.id]
            topics[channel.topic] = replace(info, message_count=count)
        return topics

    @property
    def definitions(self) -> Mapping[str, Definition]:
        """The message definitions by the name of the type."""
        return {
            schema.name: Definition(
                schema.name, schema.data.decode(errors='replace'), schema.encoding
            )
            for schema in self.schemas.values()
        }

    def messages(self, topics: Collection[str]) -> Iterator[Message]:
        """Yield the messages of some topics in the order in which they were written.

        Raises:
            BagError: The file has changed since it was opened.
        """
        wanted = {
            number: (channel.topic, self._find_type(channel))
            for number, channel in self.channels.items()
            if channel.topic in topics
        }
        for block in self.blocks:
            if wanted.keys() & block.counts:
                yield from self._read_block(block, wanted)

    def _read_block(self, block: Block, wanted: Mapping[int, tuple[str, str]]) -> list[Message]:
        with storage_errors(f'read {self.path}'), self.path.open('rb') as stream:
            stream.seek(block.offset)
            content = BytesIO(stream.read(block.end - block.offset))
        try:
            found = [
                record
                for _, offset, end in _find_spans(content, 0)
                for record in _parse_records(content, offset, end)
                if isinstance(record, records.Message)
            ]
            if len(found) != block.counts.total():
                raise DamageError(f'{len(found)} of {block.counts.total()} messages remain')
        except DamageError as damage:
            raise BagError(f'{self.path} must not change while it is read: {damage}.') from damage
        return [
            Message(*wanted[each.channel_id], each.log_time, each.publish_time, each.data)
            for each in found
            if each.channel_id in wanted
        ]

    def _find_type(self, channel: records.Channel) -> str:
        schema = self.schemas.get(channel.schema_id)
        return schema.name if schema else ''

    def _walk(self, stream: BinaryIO) -> None:
        start = end = len(MCAP0_MAGIC)
        opcode, note = 0, ''
        for opcode, offset, end in _find_spans(stream, start):
            if opcode == Opcode.DATA_END:
                note = '; all messages precede it'
            if opcode in _READ_OPCODES:
                self._read_record(stream, opcode, offset, end, note)
        size = stream.seek(0, 2)
        stream.seek(end)
        if opcode != Opcode.FOOTER or stream.read(len(MCAP0_MAGIC) + 1) != MCAP0_MAGIC:
            end = min(end, size)
            cut = 'it was truncated or damaged'
            reason = cut if end < size else f'{NOT_CLOSED_REASON}: its end is missing'
            self.losses.append(Loss(self.path, end, size - end, reason + note))

    def _read_record(
        self, stream: BinaryIO, opcode: int, offset: int, end: int, note: str
    ) -> None:
        try:
            found = _parse_records(stream, offset, end)
            if not self.losses and found:
                _check_crc(stream, found[0], offset)
            self._store_records(found, offset, end, chunked=opcode == Opcode.CHUNK)
        except DamageError as damage:
            reason = f'the record is damaged: {damage}{note}'
            self.losses.append(Loss(self.path, offset, end - offset, reason))

    def _store_records(
        self, found: list[records.McapRecord], offset: int, end: int, chunked: bool
    ) -> None:
        for record in found:
            # The first definition stands; the summary repeats it.
            if isinstance(record, records.Schema) and record.id not in self.schemas:
                self._count_definition(len(record.data))
                self.schemas[record.id] = record
            elif isinstance(record, records.Channel) and record.id not in self.channels:
                texts = (record.topic, *record.metadata, *record.metadata.values())
                self._count_definition(sum(map(len, texts)))
                self.channels[record.id] = record
            elif isinstance(record, records.Header):
                self.library = record.library
            elif isinstance(record, records.Metadata) and record.name == METADATA_NAME:
                self.metadata_text = record.metadata.get('serialized_metadata', self.metadata_text)
        messages = [each for each in found if isinstance(each, records.Message)]
        if not messages:
            return
        run = self.blocks[-1] if self.blocks and not chunked else None
        if run is None or run.chunked or run.end != offset or end - run.offset > _MAX_RUN_BYTES:
            run = Block(offset, end, chunked)
            self.blocks.append(run)
        run.end = end
        run.counts.update(each.channel_id for each in messages)
        run.earliest = min(run.earliest, *(each.log_time for each in messages))
        run.latest = max(run.latest, *(each.log_time for each in messages))

    def _count_definition(self, size: int) -> None:
        """Refuse definitions that take more than a bag may need."""
        self._definition_bytes += size
        if self._definition_bytes > _MAX_DEFINITION_BYTES:
            raise DamageError(f'definitions must have at most {_MAX_DEFINITION_BYTES} bytes')

    def _find_unknown_channels(self) -> None:
        for block in self.blocks:
            unknown = sum(n for channel, n in block.counts.items() if channel not in self.channels)
            if unknown:
                reason = f'{unknown} messages belong to channels whose definition is lost'
                self.losses.append(Loss(self.path, block.offset, 0, reason))


def _find_spans(stream: BinaryIO, offset: int) -> Iterator[tuple[int, int, int]]:
    """Yield opcode, begin and end of every record, up to a footer or an incomplete one."""
    size = stream.seek(0, 2)
    opcode = 0
    while opcode != Opcode.FOOTER:
        stream.seek(offset)
        head = stream.read(_RECORD_HEAD.size)
        if len(head) < _RECORD_HEAD.size:
            return
        opcode, length = _RECORD_HEAD.unpack(head)
        end = offset + _RECORD_HEAD.size + length
        if not opcode or end > size:  # some file systems leave zeros after a power cut
            return
        yield opcode, offset, end
        offset = end


def _parse_records(stream: BinaryIO, offset: int, end: int) -> list[records.McapRecord]:
    """Return the record there, or those of a chunk; raise `DamageError`."""
    stream.seek(offset)
    content = BytesIO(stream.read(end - offset))
    try:
        record = next(StreamReader(content, skip_magic=True, emit_chunks=True).records)
        if isinstance(record, records.Chunk):
            data = _decompress_chunk(record)
            _check_memory(data)
            return breakup_chunk(replace(record, compression='', data=data), validate_crc=True)
        return [record]
    except Exception as error:  # parsers and decompressors have no common error class
        raise DamageError(make_printable(str(error) or repr(error), 200)) from error


def _check_crc(stream: BinaryIO, record: records.McapRecord, offset: int) -> None:
    """Compare what precedes the end of the data, or of the summary, with its CRC if it has one."""
    if isinstance(record, records.DataEnd):
        begin, end, crc = 0, offset, record.data_section_crc
    elif isinstance(record, records.Footer):
        begin = record.summary_start or offset
        # the CRC covers the first 16 bytes of the footer
        end, crc = offset + _RECORD_HEAD.size + 16, record.summary_crc
    else:
        return
    found = 0
    stream.seek(begin)
    while crc and (piece := stream.read(min(_MAX_RUN_BYTES, end - begin))):
        found, begin = zlib.crc32(piece, found), begin + len(piece)
    if crc and found != crc:
        raise DamageError('what precedes it has changed, by its CRC')


def _decompress_chunk(chunk: records.Chunk) -> bytes:
    """Return the content of a chunk; raise `DamageError` if it takes more than may be held."""
    claimed = chunk.uncompressed_size  # the decompressor allocates it, or what the content claims
    if chunk.compression == 'zstd':
        size = zstandard.get_frame_parameters(chunk.data).content_size
        claimed = max(claimed, 0 if size == zstandard.CONTENTSIZE_UNKNOWN else size)
    if claimed > MAX_HELD_BYTES:
        raise DamageError(f'the chunk claims {claimed} bytes; at most {MAX_HELD_BYTES} are read')
    if chunk.compression == 'zstd':
        return zstandard.decompress(chunk.data, chunk.uncompressed_size)
    if chunk.compression == 'lz4':
        content: bytes = lz4.frame.LZ4FrameDecompressor().decompress(chunk.data, claimed)
        return content
    if chunk.compression:  # `mcap` would read it as not compressed
        raise DamageError(f'its compression must be lz4 or zstd; got {chunk.compression!r}')
    return chunk.data


def _check_memory(data: bytes) -> None:
    """Raise `DamageError` if the records of a chunk take more memory than may be held."""
    offset, held = 0, len(data)
    while offset + _RECORD_HEAD.size <= len(data):
        offset += _RECORD_HEAD.size + _RECORD_HEAD.unpack_from(data, offset)[1]
        held += RECORD_BYTES
        if held > MAX_HELD_BYTES:
            raise DamageError(f'the chunk takes over {MAX_HELD_BYTES} bytes in memory')
