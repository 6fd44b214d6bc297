# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Damage to an MCAP file costs what is damaged and no more."""

import re
from contextlib import nullcontext
from io import BytesIO
from itertools import pairwise

import pytest
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.records import Attachment, Channel, Chunk, Footer, Message, Schema
from mcap.writer import MCAP0_MAGIC, CompressionType, Writer

from mlmem_ros.bag import BagError, BagWriter, jazzy
from mlmem_ros.bag.mcap_scan import McapScan

pytestmark = pytest.mark.usefixtures('quick_disk')


@pytest.fixture
def whole(tmp_path):
    """A file of five chunks of one message each, and where the chunks lie."""
    with BagWriter(tmp_path / 'bag', sync_interval=0, compression='none') as writer:
        writer.add_topic('/n', 'std_msgs/msg/UInt8')
        for i in range(5):
            writer.write('/n', count(i), i)
    path = tmp_path / 'bag/bag_0.mcap'
    return path, McapScan(path).blocks


def count(i):
    return jazzy().serialize(jazzy().message('std_msgs/msg/UInt8', data=i))


def found(scan):
    return [m.data[4] for block in scan.blocks for m in scan.messages(block, set(scan.channels))]


class InMemory:
    """The content of a file, for thousands of them."""

    def __init__(self, content):
        self.content = content

    def open(self, mode):
        assert mode == 'rb'
        return BytesIO(self.content)


def encode(*records):
    builder = RecordBuilder()
    for record in records:
        record.write(builder)
    return builder.end()


def test_a_whole_file_has_no_losses(whole):
    path, _ = whole
    assert found(McapScan(path)) == [0, 1, 2, 3, 4]
    assert McapScan(path).losses == []


def test_truncation_at_any_byte_keeps_every_chunk_before_it(whole):
    path, blocks = whole
    content = path.read_bytes()
    ends = [block.end for block in blocks]
    for size in range(len(content)):
        scan = McapScan(InMemory(content[:size]))
        assert found(scan) == [i for i, end in enumerate(ends) if end <= size]
        assert scan.losses, 'a file that was not closed must not pass as whole'
        assert all(loss.offset + loss.size <= size for loss in scan.losses)


def test_a_wrong_byte_anywhere_never_makes_a_wrong_message(whole):
    path, _ = whole
    content = path.read_bytes()
    for offset in range(len(content)):
        wrong = bytes([content[offset] ^ 0x55])
        bad = InMemory(content[:offset] + wrong + content[offset + 1 :])
        # Only the magic, the first eight bytes, decides whether it is an MCAP file at all.
        with pytest.raises(BagError) if offset < 8 else nullcontext():
            assert set(found(McapScan(bad))) <= {0, 1, 2, 3, 4}


def test_a_damaged_chunk_costs_its_own_messages(whole):
    path, blocks = whole
    content = bytearray(path.read_bytes())
    content[blocks[2].end - 1] ^= 0xFF
    path.write_bytes(content)
    scan = McapScan(path)
    assert found(scan) == [0, 1, 3, 4]
    (loss,) = scan.losses
    assert (loss.offset, loss.offset + loss.size) == (blocks[2].offset, blocks[2].end)
    assert 'crc validation failed' in loss.reason


def test_what_lies_behind_a_wrong_length_is_lost_and_told(whole):
    path, blocks = whole
    content = bytearray(path.read_bytes())
    content[blocks[1].offset + 1 : blocks[1].offset + 9] = b'\xff' * 8
    path.write_bytes(content)
    scan = McapScan(path)
    assert found(scan) == [0]
    (loss,) = scan.losses
    assert (loss.offset, loss.offset + loss.size) == (blocks[1].offset, len(content))


def test_a_closed_file_whose_first_chunk_is_damaged_has_its_definitions(whole):
    """They stand in the first chunk, and again in the summary."""
    path, blocks = whole
    content = bytearray(path.read_bytes())
    content[blocks[0].end - 1] ^= 0xFF
    path.write_bytes(content)
    scan = McapScan(path)
    assert found(scan) == [1, 2, 3, 4]
    assert [channel.topic for channel in scan.channels.values()] == ['/n']


def test_zeros_at_the_end_are_told(whole):
    # What some file systems leave after a power cut.
    path, blocks = whole
    content = path.read_bytes()
    path.write_bytes(content[: blocks[3].offset] + bytes(4096))
    scan = McapScan(path)
    assert found(scan) == [0, 1, 2]
    assert scan.losses[0].size == 4096


def test_a_cut_summary_costs_no_message(whole):
    path, _ = whole
    path.write_bytes(path.read_bytes()[:-20])
    scan = McapScan(path)
    assert found(scan) == [0, 1, 2, 3, 4]
    assert scan.losses[0].reason.endswith('all messages precede it')


@pytest.mark.parametrize('compression', list(CompressionType))
@pytest.mark.parametrize('chunked', [True, False])
def test_files_of_other_writers_are_read(tmp_path, compression, chunked):
    # Such as rosbag2's presets: no chunks ("fastwrite"), lz4, zstd, CRC or not.
    path = tmp_path / 'other.mcap'
    writer = Writer(
        str(path),
        chunk_size=100,
        compression=compression,
        use_chunking=chunked,
        enable_crcs=False,
    )
    writer.start()
    schema = writer.register_schema('std_msgs/msg/UInt8', 'ros2msg', b'uint8 data')
    channel = writer.register_channel('/n', 'cdr', schema)
    for i in range(10):
        writer.add_message(channel, i, count(i), i)
    writer.finish()
    scan = McapScan(path)
    assert found(scan) == list(range(10))
    assert scan.losses == []
    assert all(a.end <= b.offset for a, b in pairwise(scan.blocks))


def test_messages_whose_channel_is_lost_are_told(tmp_path):
    # mcap's writer puts channels into the first chunk. Killed, it leaves no summary to help.
    path = tmp_path / 'other.mcap'
    with path.open('wb') as stream:
        writer = Writer(stream, chunk_size=50, compression=CompressionType.NONE)
        writer.start()
        channel = writer.register_channel('/n', 'cdr', 0)
        for i in range(4):
            writer.add_message(channel, i, bytes(100), i)
    content = bytearray(path.read_bytes())
    content[McapScan(path).blocks[0].offset + 60] ^= 0xFF
    path.write_bytes(content)
    scan = McapScan(path)
    reasons = [loss.reason for loss in scan.losses]
    assert reasons.count('1 messages belong to channels whose definition is lost') == 3


def test_what_is_no_mcap_file_is_refused(tmp_path):
    (tmp_path / 'a.mcap').write_bytes(b'SQLite format 3\0')
    with pytest.raises(BagError, match=r'a\.mcap must be an MCAP file; it begins with'):
        McapScan(tmp_path / 'a.mcap')


def test_a_file_that_changes_while_it_is_read_is_told(whole):
    path, blocks = whole
    scan = McapScan(path)
    content = bytearray(path.read_bytes())
    content[blocks[1].end - 1] ^= 0xFF
    path.write_bytes(content)
    with pytest.raises(BagError, match=r'bag_0\.mcap must not change while it is read: crc'):
        found(scan)


def test_a_chunk_without_messages_is_no_block_but_tells_its_channels(tmp_path):
    """And a record in it that does not belong there is passed over."""
    schema = Schema(1, b'uint8 data', 'ros2msg', 'std_msgs/msg/UInt8')
    channel = Channel(7, '/n', 'cdr', {}, 1)
    inside = encode(schema, Attachment(0, 0, 'a.txt', 'text/plain', b'hello'), channel)
    chunk = Chunk('', inside, 0, 0, 0, len(inside))
    path = tmp_path / 'other.mcap'
    message = Message(channel_id=7, log_time=5, publish_time=5, sequence=0, data=b'')
    path.write_bytes(MCAP0_MAGIC + encode(chunk, message, Footer(0, 0, 0)) + MCAP0_MAGIC)
    scan = McapScan(path)
    assert scan.losses == []
    assert scan.schemas == {1: schema}
    assert scan.channels == {7: channel}
    assert [(block.chunked, block.counts) for block in scan.blocks] == [(False, {7: 1})]


def file_of(**changes):
    """Return a file of one uncompressed chunk that holds a message, with something changed."""
    message = encode(Message(channel_id=7, log_time=5, publish_time=5, sequence=0, data=b''))
    values = {
        'compression': '', 'data': message, 'message_start_time': 0, 'message_end_time': 0,
        'uncompressed_crc': 0, 'uncompressed_size': len(message),
    }  # fmt: skip
    definitions = encode(Channel(7, '/n', 'cdr', {}, 0))
    chunk = encode(Chunk(**values | changes))
    return InMemory(MCAP0_MAGIC + definitions + chunk + encode(Footer(0, 0, 0)) + MCAP0_MAGIC)


@pytest.mark.parametrize(
    ('changes', 'told'),
    [
        ({'compression': 'lzma'}, "its compression must be lz4 or zstd; got 'lzma'"),
        ({'uncompressed_size': 2**27 + 1}, 'it claims to hold 134217729 bytes; at most 134217728'),
        (
            {'compression': 'zstd', 'data': zstandard.compress(bytes(2**28))},
            'it claims to hold 268435456 bytes',
        ),
        ({'uncompressed_crc': 1}, 'crc'),
        ({'compression': 'zstd'}, 'zstd|frame|header'),
        ({'data': b'\x05'}, 'damaged'),
    ],
)
def test_a_chunk_that_lies_is_damaged(changes, told):
    assert not McapScan(file_of()).losses
    scan = McapScan(file_of(**changes))
    (loss,) = scan.losses
    assert re.search(told, loss.reason, re.IGNORECASE)
    assert scan.blocks == []
