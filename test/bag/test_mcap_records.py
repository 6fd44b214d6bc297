# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""No length in an MCAP file is believed before it has been checked."""

import struct
from io import BytesIO

import pytest
import zstandard
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Schema

from mlmem_ros.bag import mcap_records
from mlmem_ros.bag.mcap_records import DamageError

SCHEMA = Schema(1, b'uint8 data', 'ros2msg', 'std_msgs/msg/UInt8')
CHANNEL = Channel(7, '/n', 'cdr', {'offered_qos_profiles': ''}, 1)


def chunk(**changes):
    """Return the content of an uncompressed chunk that holds a schema."""
    inside = mcap_records.encode(SCHEMA)
    values = {
        'compression': '', 'data': inside, 'message_start_time': 0, 'message_end_time': 0,
        'uncompressed_crc': 0, 'uncompressed_size': len(inside),
    }  # fmt: skip
    record = mcap_records.encode(Chunk(**values | changes))
    return memoryview(record)[mcap_records.HEAD_SIZE :]


def test_records_come_back_one_by_one():
    content = memoryview(mcap_records.encode(SCHEMA, CHANNEL))
    (first, schema), (second, channel) = mcap_records.records(content)
    assert (first, second) == (Opcode.SCHEMA, Opcode.CHANNEL)
    assert mcap_records.parse(Schema, schema) == SCHEMA
    assert mcap_records.parse(Channel, channel) == CHANNEL


@pytest.mark.parametrize('missing', range(1, len(mcap_records.encode(SCHEMA))))
def test_a_cut_record_is_damage_wherever_it_is_cut(missing):
    whole = mcap_records.encode(CHANNEL, SCHEMA)
    short = mcap_records.encode(SCHEMA)[:-missing]
    told = 'no whole head' if len(short) < 9 else 'a schema record inside it is longer than'
    walk = mcap_records.records(memoryview(whole[:-missing]))
    assert next(walk)[0] == Opcode.CHANNEL
    with pytest.raises(DamageError, match=told):
        next(walk)
    with pytest.raises(DamageError):
        mcap_records.read_head(BytesIO(short), 0, len(short))


def test_a_head_tells_where_its_record_ends():
    content = mcap_records.encode(SCHEMA, CHANNEL)
    middle = len(mcap_records.encode(SCHEMA))
    stream = BytesIO(content)
    assert mcap_records.read_head(stream, 0, len(content)) == (Opcode.SCHEMA, middle)
    assert mcap_records.read_head(stream, middle, len(content)) == (Opcode.CHANNEL, len(content))


def test_a_head_that_wants_more_than_the_file_has():
    huge = struct.pack('<BQ', 0x77, 1000)
    with pytest.raises(DamageError, match=r'0x77\) record needs 1000 bytes, the file has 3'):
        mcap_records.read_head(BytesIO(huge + bytes(3)), 0, len(huge) + 3)


def test_a_message_has_a_head_of_22_bytes():
    head = struct.pack('<HIQQ', 7, 3, 10, 11)
    assert mcap_records.parse_message(memoryview(head)) == (7, 10, 11, b'')
    with pytest.raises(DamageError, match='a message record is too short'):
        mcap_records.parse_message(memoryview(head[:-1]))


def test_a_record_of_another_form():
    with pytest.raises(DamageError, match='a Schema record cannot be parsed'):
        mcap_records.parse(Schema, memoryview(b'\x01'))


def test_a_chunk_holds_what_it_says():
    assert mcap_records.unpack_chunk(chunk()) == mcap_records.encode(SCHEMA)
    assert mcap_records.unpack_chunk(chunk(data=b'', uncompressed_size=0)) == b''


@pytest.mark.parametrize(
    ('changes', 'told'),
    [
        ({'compression': 'lzma'}, "its compression 'lzma' is none of lz4 and zstd"),
        ({'uncompressed_size': 2**27 + 1}, 'it claims to hold 134217729 bytes; at most 134217728'),
        ({'uncompressed_size': 2**27}, 'instead of 134217728'),
        (
            {'compression': 'zstd', 'data': zstandard.compress(bytes(2**28))},
            'its data claim to hold 268435456 bytes',
        ),
        ({'uncompressed_size': 7}, 'bytes instead of 7'),
        ({'uncompressed_crc': 1}, 'crc'),
        ({'compression': 'zstd'}, 'zstd|frame|header'),
    ],
)
def test_a_chunk_that_lies(changes, told):
    with pytest.raises(DamageError, match=f'(?i){told}'):
        mcap_records.unpack_chunk(chunk(**changes))


def test_a_chunk_with_bytes_after_its_data():
    with pytest.raises(DamageError, match='its lengths contradict each other'):
        mcap_records.unpack_chunk(memoryview(bytes(chunk()) + b'\0'))
    with pytest.raises(DamageError, match='its head cannot be parsed'):
        mcap_records.unpack_chunk(chunk()[:20])


@pytest.mark.parametrize('name', ['', 'lz4', 'zstd'])
@pytest.mark.parametrize('before', [0, 1, (1 << 20) - 30, 3 << 20])
def test_the_next_chunk_is_found_across_the_windows_of_the_search(name, before):
    """The search looks at a MiB at once; a chunk may begin at the end of one."""
    record = mcap_records.encode(Chunk(name, b'data', 2, 1, 0, 4))
    content = b'\x06' * before + record
    assert mcap_records.find_chunk(BytesIO(content), 0, len(content)) == before
    assert mcap_records.find_chunk(BytesIO(content), before, len(content)) == before
    assert mcap_records.find_chunk(BytesIO(content), before + 1, len(content)) is None
    assert mcap_records.find_chunk(BytesIO(content), 0, len(content) - 1) is None
