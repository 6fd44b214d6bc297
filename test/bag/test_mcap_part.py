# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Damage to an MCAP file costs only what is damaged."""

from contextlib import nullcontext
from io import BytesIO
from types import SimpleNamespace

import pytest
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Footer, Message
from mcap.writer import MCAP0_MAGIC, CompressionType, Writer
from suite import sampled

from mlmem_ros.bag import jazzy
from mlmem_ros.bag.errors import BagError
from mlmem_ros.bag.mcap_part import McapPart, _find_spans
from mlmem_ros.bag.writer import BagWriter

BOMB = bytes(2**27 + 1)


@pytest.fixture
def whole(tmp_path):
    """A file of five chunks of one message each, and where the chunks lie."""
    with BagWriter(tmp_path / 'bag') as writer:
        writer.add_topic('/n', 'std_msgs/msg/UInt8')
        for i in range(5):
            writer.write('/n', count(i), i)
            writer.sync()
    path = tmp_path / 'bag' / 'bag_0.mcap'
    return path, find_chunks(path)


def find_chunks(path):
    """Return where each chunk begins and ends in a file."""
    with path.open('rb') as stream:
        return [
            (offset, end)
            for opcode, offset, end in _find_spans(stream, len(MCAP0_MAGIC))
            if opcode == Opcode.CHUNK
        ]


def count(i):
    return jazzy.encode_message('std_msgs/msg/UInt8', data=i)


def found(part):
    return [message.cdr[4] for message in part.messages(part.topics)]


def keep_in_memory(content):
    """Return what opens as a file of this content, for thousands of them."""
    return SimpleNamespace(open=lambda _: BytesIO(content))


def encode(*records):
    builder = RecordBuilder()
    for record in records:
        record.write(builder)
    return builder.end()


EVERY = sampled([5, 1], lambda every: every > 1)
"""Of which bytes each is tried; where a chunk ends, all around it."""


def tried(content, blocks, every):
    near = {end + n for end in (0, *(end for _, end in blocks)) for n in range(-9, 10)}
    return [n for n in range(len(content)) if n % every == 0 or n in near]


@pytest.mark.parametrize('every', EVERY)
def test_truncation_keeps_every_chunk_before_it(whole, every):
    path, blocks = whole
    content = path.read_bytes()
    ends = [end for _, end in blocks]
    for size in tried(content, blocks, every):
        part = McapPart(keep_in_memory(content[:size]))
        assert found(part) == [i for i, end in enumerate(ends) if end <= size]
        assert part.losses, 'a file that was not closed must not pass as whole'
        assert all(loss.offset + loss.size <= size for loss in part.losses)


@pytest.mark.parametrize('every', EVERY)
def test_wrong_byte_never_makes_a_wrong_message(whole, every):
    """It is reported, but for the type of the record that ends the data."""
    path, blocks = whole
    content, unreported = path.read_bytes(), []
    for offset in tried(content, blocks, every):
        wrong = bytes([content[offset] ^ 0x55])
        bad = keep_in_memory(content[:offset] + wrong + content[offset + 1 :])
        # Only the magic, the first eight bytes, decides whether it is an MCAP file at all.
        with pytest.raises(BagError) if offset < 8 else nullcontext():
            part = McapPart(bad)
            assert set(found(part)) <= {0, 1, 2, 3, 4}
            unreported += [] if part.losses else [content[offset]]
    assert set(unreported) <= {Opcode.DATA_END}


def damage_chunk(content, offset, end):
    content[end - 1] ^= 0xFF


def damage_length(content, offset, end):
    content[offset + 1 : offset + 9] = b'\xff' * 8


def cut_summary(content, offset, end):
    del content[-20:]


def move_summary(content, offset, end):
    content[-22] ^= 0x80  # to where no file has anything


@pytest.mark.parametrize(
    ('damage', 'number', 'kept', 'reason'),
    [
        (damage_chunk, 2, [0, 1, 3, 4], 'the record is damaged'),
        (damage_chunk, 0, [1, 2, 3, 4], 'the record is damaged'),  # definitions are in the summary
        (damage_length, 1, [0], 'truncated or damaged'),
        (cut_summary, 4, [0, 1, 2, 3, 4], 'all messages precede it'),
        (move_summary, 4, [0, 1, 2, 3, 4], 'by its CRC; all messages precede it'),
    ],
)
def test_damage_costs_only_what_is_damaged(whole, damage, number, kept, reason):
    path, blocks = whole
    content, (offset, end) = bytearray(path.read_bytes()), blocks[number]
    damage(content, offset, end)
    path.write_bytes(content)
    part = McapPart(path)
    assert found(part) == kept
    assert [channel.topic for channel in part.channels.values()] == ['/n']
    (loss,) = part.losses
    assert reason in loss.reason
    if damage in (damage_chunk, damage_length):
        end = end if damage is damage_chunk else len(content)
        assert (loss.offset, loss.offset + loss.size) == (offset, end)


@pytest.mark.parametrize('compression', list(CompressionType))
@pytest.mark.parametrize('chunked', [True, False])
def test_files_of_other_writers_are_read(tmp_path, compression, chunked):
    # Such as rosbag2's presets: no chunks ("fastwrite"), lz4, zstd, CRC or not.
    path = tmp_path / 'other.mcap'
    writer = Writer(
        str(path), chunk_size=100, compression=compression, use_chunking=chunked, enable_crcs=False
    )
    writer.start()
    schema = writer.register_schema('std_msgs/msg/UInt8', 'ros2msg', b'uint8 data')
    channel = writer.register_channel('/n', 'cdr', schema)
    for i in range(10):
        writer.add_message(channel, i, count(i), i)
    writer.finish()
    part = McapPart(path)
    assert found(part) == list(range(10))
    assert part.losses == []


def test_messages_of_a_lost_channel_are_reported(tmp_path):
    # mcap's writer puts channels into the first chunk. Killed, it leaves no summary to help.
    path = tmp_path / 'other.mcap'
    with path.open('wb') as stream:
        writer = Writer(stream, chunk_size=50, compression=CompressionType.NONE)
        writer.start()
        channel = writer.register_channel('/n', 'cdr', 0)
        for i in range(4):
            writer.add_message(channel, i, bytes(100), i)
    content = bytearray(path.read_bytes())
    content[find_chunks(path)[0][0] + 60] ^= 0xFF
    path.write_bytes(content)
    part = McapPart(path)
    reasons = [loss.reason for loss in part.losses]
    assert reasons[-1] == '3 messages belong to channels whose definition is lost'


def file_of(**changes):
    """Return a file of one uncompressed chunk with a message, with changes to the chunk."""
    message = encode(Message(channel_id=7, log_time=5, publish_time=5, sequence=0, data=b''))
    values = {
        'compression': '', 'data': message, 'message_start_time': 0, 'message_end_time': 0,
        'uncompressed_crc': 0, 'uncompressed_size': len(message),
    }  # fmt: skip
    definitions = encode(Channel(7, '/n', 'cdr', {}, 0))
    chunk = encode(Chunk(**values | changes))
    return keep_in_memory(
        MCAP0_MAGIC + definitions + chunk + encode(Footer(0, 0, 0)) + MCAP0_MAGIC
    )


@pytest.mark.parametrize(
    ('changes', 'reason'),
    [
        ({'compression': 'zstd'}, 'damaged'),
        ({'compression': 'lz4'}, 'damaged'),
        ({'compression': 'bz2'}, 'damaged'),
        ({'uncompressed_crc': 1}, 'damaged'),
        ({'data': b'\x05'}, 'damaged'),
        ({'uncompressed_size': 2**27 + 1}, 'at most 134217728'),
        ({'compression': 'zstd', 'data': zstandard.compress(BOMB)}, 'at most 134217728'),
    ],
)
def test_inconsistent_or_huge_chunk_is_not_read(changes, reason):
    assert not McapPart(file_of()).losses
    part = McapPart(file_of(**changes))
    (loss,) = part.losses
    assert reason in loss.reason
    assert found(part) == []
