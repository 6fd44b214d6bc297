# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The records of an MCAP file, one by one, with every length checked before it is believed."""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from io import BytesIO
from typing import BinaryIO, TypeVar

import zstandard
from mcap.data_stream import ReadDataStream, RecordBuilder
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, McapRecord, Metadata, Schema
from mcap.stream_reader import get_chunk_data_stream

HEAD_SIZE = 9
"""Bytes before the content of every record: opcode and length."""

_HEAD = struct.Struct('<BQ')
_MESSAGE = struct.Struct('<HIQQ')  # channel, sequence, log time, publish time
_CHUNK_FIXED = 40  # bytes of a chunk besides the name of its compression and its data
_LARGEST_CHUNK = 2**27  # bytes, uncompressed; a file of a megabyte must not fill the memory
_COMPRESSIONS = {'', 'lz4', 'zstd'}
# A chunk up to the length of its data. The lookahead lets the search find a chunk that begins
# within bytes that merely look like one.
_CHUNK_START = re.compile(
    rb'\x06(?=(?P<length>.{8}).{28}'
    rb'(?:\0{4}|\x03\0{3}(?P<lz4>lz4)|\x04\0{3}(?P<zstd>zstd))(?P<size>.{8}))',
    re.DOTALL,
)
_WINDOW = 1 << 20  # bytes searched at once
_OVERLAP = 64  # bytes, longer than the start of a chunk

_Parsed = TypeVar('_Parsed', Schema, Channel, Metadata)


class DamageError(Exception):
    """A record is not what it claims to be; the text says in which way."""


def encode(*records: McapRecord) -> bytes:
    """Encode records back to back.

    Args:
        *records: The records.

    Returns:
        The bytes as they stand in a file.
    """
    builder = RecordBuilder()
    for record in records:
        record.write(builder)
    content: bytes = builder.end()  # type: ignore[no-untyped-call]
    return content


def read_head(stream: BinaryIO, offset: int, end: int) -> tuple[int, int]:
    """Read the head of a record in a file.

    Args:
        stream: The file.
        offset: Where the record begins.
        end: Size of the file.

    Returns:
        The record's opcode and where it ends.

    Raises:
        DamageError: There is no whole record.
    """
    stream.seek(offset)
    head = stream.read(HEAD_SIZE)
    if len(head) < HEAD_SIZE:
        raise DamageError('the file ends inside the head of a record')
    opcode, length = _HEAD.unpack(head)
    if opcode == 0:
        raise DamageError('there are zeros where a record should be')
    if offset + HEAD_SIZE + length > end:
        raise DamageError(
            f'a {_name(opcode)} record needs {length} bytes, '
            f'the file has {end - offset - HEAD_SIZE} more'
        )
    return opcode, offset + HEAD_SIZE + length


def records(content: memoryview) -> Iterator[tuple[int, memoryview]]:
    """Walk through records in memory.

    Args:
        content: Records back to back.

    Yields:
        Opcode and content of each record.

    Raises:
        DamageError: A record does not end where the next begins.
    """
    offset = 0
    while offset < len(content):
        if offset + HEAD_SIZE > len(content):
            raise DamageError('its last record has no whole head')
        opcode, length = _HEAD.unpack_from(content, offset)
        offset += HEAD_SIZE
        if offset + length > len(content):
            raise DamageError(f'a {_name(opcode)} record inside it is longer than the rest')
        yield opcode, content[offset : offset + length]
        offset += length


def parse(kind: type[_Parsed], content: memoryview) -> _Parsed:
    """Parse a schema, channel or metadata record.

    Args:
        kind: Class of the record.
        content: Content of the record.

    Returns:
        The record.

    Raises:
        DamageError: The content has another form.
    """
    try:
        record: _Parsed = kind.read(ReadDataStream(BytesIO(content)))
    except (McapError, OverflowError, ValueError, struct.error) as error:
        raise DamageError(f'a {kind.__name__} record cannot be parsed: {error!r}') from error
    return record


def parse_message(content: memoryview) -> tuple[int, int, int, memoryview]:
    """Parse a message record.

    Args:
        content: Content of the record.

    Returns:
        Channel id, log time, publish time and data.

    Raises:
        DamageError: The record is too short.
    """
    if len(content) < _MESSAGE.size:
        raise DamageError('a message record is too short')
    channel, _, log_time, publish_time = _MESSAGE.unpack_from(content)
    return channel, log_time, publish_time, content[_MESSAGE.size :]


def unpack_chunk(content: memoryview) -> memoryview:
    """Check and decompress a chunk.

    Args:
        content: Content of the chunk record.

    Returns:
        The records inside it, to be walked by `records`.

    Raises:
        DamageError: Its lengths, its compression or its CRC are wrong.
    """
    try:
        chunk = Chunk.read(ReadDataStream(BytesIO(content)))
    except (McapError, OverflowError, ValueError, struct.error) as error:
        raise DamageError(f'its head cannot be parsed: {error!r}') from error
    if len(content) != _CHUNK_FIXED + len(chunk.compression.encode()) + len(chunk.data):
        raise DamageError('its lengths contradict each other')
    if chunk.compression not in _COMPRESSIONS:
        raise DamageError(f'its compression {chunk.compression!r} is none of lz4 and zstd')
    if chunk.uncompressed_size > _LARGEST_CHUNK:
        size, most = chunk.uncompressed_size, _LARGEST_CHUNK
        raise DamageError(f'it claims to hold {size} bytes; at most {most} are taken')
    try:
        if chunk.compression == 'zstd':  # whose own claim is what would be allocated
            claimed = zstandard.get_frame_parameters(chunk.data).content_size
            if claimed not in (chunk.uncompressed_size, zstandard.CONTENTSIZE_UNKNOWN):
                raise DamageError(f'its data claim to hold {claimed} bytes')
        stream, size = get_chunk_data_stream(chunk, validate_crc=True)
    except DamageError:
        raise
    except Exception as error:  # the decompressors share no error
        raise DamageError(f'{error}') from error
    if size != chunk.uncompressed_size:
        raise DamageError(f'it holds {size} bytes instead of {chunk.uncompressed_size}')
    return memoryview(stream.read(size))


def find_chunk(stream: BinaryIO, start: int, end: int) -> int | None:
    """Search for the next chunk after damage.

    Two lengths that agree and the name of a compression between them are told from chance.

    Args:
        stream: The file.
        start: Where to begin.
        end: Size of the file.

    Returns:
        Where a chunk begins, or None if there is no further one.
    """
    for position in range(start, end, _WINDOW):
        stream.seek(position)
        window = stream.read(_WINDOW + _OVERLAP)
        for match in _CHUNK_START.finditer(window):
            offset = position + match.start()
            length = int.from_bytes(match['length'], 'little')
            name = match['lz4'] or match['zstd'] or b''
            size = int.from_bytes(match['size'], 'little')
            fits = offset + HEAD_SIZE + length <= end
            if fits and length == _CHUNK_FIXED + len(name) + size:
                return offset
    return None


def _name(opcode: int) -> str:
    try:
        return Opcode(opcode).name.lower().replace('_', ' ')
    except ValueError:
        return f'unknown (opcode {opcode:#04x})'
