# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Read one MCAP file as far as possible, whether whole, truncated or damaged.

The records are read from the front, in the order they were written, and parsed by `mcap`; each
chunk is checked by its CRC, and so is the whole file if its recorder gave it one. No index or
summary is needed: a killed recorder leaves none. A chunk is read whole or not at all: the start of
a damaged one may look right and be wrong. Nothing after a damaged length field is recovered.
"""

from __future__ import annotations

import math
import struct
import zlib
from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace
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

from .contents import NOT_CLOSED_REASON, Loss, Message, TopicInfo
from .errors import BagError, storage_errors


class DamageError(Exception):
    """A record is damaged; the text says how."""


class McapPart:
    """What one MCAP file of a bag holds. One chunk of it is in memory at a time.

    Attributes:
        schemas: Message types by id.
        channels: Channels by id.
        span: Earliest and latest log time in nanoseconds, or None without messages.
        number: Its place among the files of its bag, from 0; None if another program wrote it.
        losses: What of it cannot be read.
    """

    def __init__(self, path: Path) -> None:
        """Walk through the file.

        Raises:
            BagError: The file cannot be opened or is not an MCAP file.
        """
        self.path = path
        self.schemas: dict[int, records.Schema] = {}
        self.channels: dict[int, records.Channel] = {}
        self.span: tuple[int, int] | None = None
        self.number: int | None = None
        self.losses: list[Loss] = []
        self._counts: Counter[int] = Counter()  # messages by channel
        self._end: float = math.inf  # of what was whole when it was opened: it may be recorded
        for record in self._read_records(self.losses):
            self._store_record(record)
        if unknown := sum(self._counts[each] for each in self._counts.keys() - self.channels):
            reason = f'{unknown} messages belong to channels whose definition is lost'
            self.losses.append(Loss(path, 0, 0, reason))

    @property
    def topics(self) -> Mapping[str, TopicInfo]:
        """The topics by name, with the number of messages that can be read."""
        topics: dict[str, TopicInfo] = {}
        for channel in self.channels.values():
            type_hash = channel.metadata.get('topic_type_hash', '')
            info = TopicInfo(channel.topic, self._find_type(channel), type_hash)
            topics.setdefault(channel.topic, info).message_count += self._counts[channel.id]
        return topics

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
        left = self._counts.total()
        for record in self._read_records():
            if isinstance(record, records.Message):
                left -= 1
                if record.channel_id in wanted:
                    yield Message(*wanted[record.channel_id], record.log_time, record.data)
        if left:
            raise BagError(f'{self.path} must not change while it is read.')

    def _find_type(self, channel: records.Channel) -> str:
        schema = self.schemas.get(channel.schema_id)
        return schema.name if schema else ''

    def _read_records(self, losses: list[Loss] | None = None) -> Iterator[records.McapRecord]:
        """Yield every record that is whole, those of a chunk in its place; list what is lost, and
        compare the CRCs of the file, if the losses are given.
        """
        with storage_errors(f'read {self.path}'), self.path.open('rb') as stream:
            magic = stream.read(len(MCAP0_MAGIC))
            if not MCAP0_MAGIC.startswith(magic):
                raise BagError(f'{self.path} must be an MCAP file; it begins with {magic!r}.')
            end, opcode, note = len(MCAP0_MAGIC), 0, ''
            read_opcodes = {
                *(Opcode.HEADER, Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE, Opcode.CHUNK),
                *(Opcode.METADATA, Opcode.DATA_END, Opcode.FOOTER),
            }
            for opcode, offset, end in _find_spans(stream, len(MCAP0_MAGIC)):
                if offset >= self._end:
                    return
                if opcode == Opcode.DATA_END:
                    note = '; all messages precede it'
                if opcode not in read_opcodes:
                    continue
                try:
                    found = _parse_records(stream, offset, end)
                    if losses is not None and not losses and found:
                        _check_crc(stream, found[0], offset)
                except DamageError as damage:
                    if losses is not None:
                        reason = f'the record is damaged: {damage}{note}'
                        losses.append(Loss(self.path, offset, end - offset, reason))
                else:
                    yield from found
            self._end, size = end, stream.seek(0, 2)
            stream.seek(end)
            if opcode == Opcode.FOOTER and stream.read(len(MCAP0_MAGIC) + 1) == MCAP0_MAGIC:
                return
            end = min(end, size)
            cut = 'it was truncated or damaged'
            reason = cut if end < size else f'{NOT_CLOSED_REASON}: its end is missing'
            if losses is not None:
                losses.append(Loss(self.path, end, size - end, reason + note))

    def _store_record(self, record: records.McapRecord) -> None:
        # The first definition stands; the summary repeats it.
        if isinstance(record, records.Schema) and record.id not in self.schemas:
            self.schemas[record.id] = record
        elif isinstance(record, records.Channel) and record.id not in self.channels:
            self.channels[record.id] = record
        elif isinstance(record, records.Metadata) and record.name == 'mlmem_ros':
            part = record.metadata.get('part', '')
            self.number = int(part) if part.isdecimal() and len(part) < 5 else None
        elif isinstance(record, records.Message):
            self._counts[record.channel_id] += 1
            earliest, latest = self.span or (record.log_time, record.log_time)
            self.span = min(earliest, record.log_time), max(latest, record.log_time)


def _find_spans(stream: BinaryIO, offset: int) -> Iterator[tuple[int, int, int]]:
    """Yield opcode, begin and end of every record, up to a footer or an incomplete one."""
    size = stream.seek(0, 2)
    opcode = 0
    while opcode != Opcode.FOOTER:
        stream.seek(offset)
        head = stream.read(9)  # bytes of the opcode, and of the length that follows
        if len(head) < 9:
            return
        opcode, length = struct.unpack('<BQ', head)
        end = offset + 9 + length
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
            return breakup_chunk(replace(record, compression='', data=data), validate_crc=True)
        return [record]
    except Exception as error:  # parsers and decompressors have no common error class
        raise DamageError(make_printable(str(error) or repr(error), 200)) from error


def _check_crc(stream: BinaryIO, record: records.McapRecord, offset: int) -> None:
    """Compare what precedes the end of the data, or of the summary, with its CRC if it has one."""
    if isinstance(record, records.DataEnd):
        begin, end, crc = 0, offset, record.data_section_crc
    elif isinstance(record, records.Footer):
        begin = min(record.summary_start or offset, offset)  # damaged, it may lie anywhere
        # the CRC covers opcode and length of the footer and its first 16 bytes
        end, crc = offset + 9 + 16, record.summary_crc
    else:
        return
    found = 0
    stream.seek(begin)
    while crc and (piece := stream.read(min(1 << 20, end - begin))):
        found, begin = zlib.crc32(piece, found), begin + len(piece)
    if crc and found != crc:
        raise DamageError('what precedes it has changed, by its CRC')


def _decompress_chunk(chunk: records.Chunk, max_bytes: int = 2**27) -> bytes:
    """Return the content of a chunk; raise `DamageError` if it takes more than may be held in
    memory, however small the file is.
    """
    claimed = chunk.uncompressed_size  # the decompressor allocates it, or what the content claims
    if chunk.compression == 'zstd':
        size = zstandard.get_frame_parameters(chunk.data).content_size
        claimed = max(claimed, 0 if size == zstandard.CONTENTSIZE_UNKNOWN else size)
    if claimed > max_bytes:
        raise DamageError(f'the chunk claims {claimed} bytes; at most {max_bytes} are read')
    if chunk.compression == 'zstd':
        return zstandard.decompress(chunk.data, chunk.uncompressed_size)
    if chunk.compression == 'lz4':
        content: bytes = lz4.frame.LZ4FrameDecompressor().decompress(chunk.data, claimed)
        return content
    if chunk.compression:  # `mcap` would read it as not compressed
        raise DamageError(f'its compression must be lz4 or zstd; got {chunk.compression!r}')
    return chunk.data
