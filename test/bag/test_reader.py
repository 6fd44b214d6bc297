# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Bags are read whoever recorded them and however the recording ended."""

import tracemalloc

import mcap.writer
import numpy as np
import pytest
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from mlmem_ros.bag import jazzy
from mlmem_ros.bag.errors import BagError
from mlmem_ros.bag.reader import BagReader
from mlmem_ros.bag.writer import BagWriter

FLOAT = 'std_msgs/msg/Float64'


def write_one(path, kind, metadata, *bodies):
    """Write a file of one channel by `mcap`, with messages of these bytes behind their header."""
    with path.open('wb') as stream:
        writer = mcap.writer.Writer(stream)
        writer.start()
        schema = writer.register_schema(kind, 'ros2msg', b'float64 data')
        channel = writer.register_channel('/x', 'cdr', schema, metadata)
        for body in bodies:
            writer.add_message(channel, 1, bytes([0, 1, 0, 0]) + body, 1)
        writer.finish()


def values(reader):
    return [reader.deserialize(message).data for message in reader]


def test_messages_come_back_in_order(record, messages):
    path = record()
    reader = BagReader(path)
    assert list(reader) == list(BagReader(path / 'bag_0.mcap')) == messages
    assert reader.message_count == 45
    assert reader.span == (messages[0].log_time, messages[-1].log_time)
    assert reader.losses == ()
    topic = reader.topics['/mlmem/range']
    assert (topic.type, topic.type_hash) == (FLOAT, jazzy.find_definition(FLOAT).hash)
    assert topic.message_count == 15
    some = ['/mlmem/probe', '/not/there']
    assert list(reader.session_messages(some)) == [m for m in messages if m.topic == some[0]]


def test_order_is_that_of_writing_across_chunks_and_files(tmp_path):
    # With random log times, in chunks of one message, in files of a few.
    times = np.random.default_rng(3).permutation(100).tolist()
    with BagWriter(tmp_path / 'bag', max_bytes=4096) as writer:
        writer.add_topic('/n', 'std_msgs/msg/UInt8', begins_file=True)
        for time in times:
            writer.write('/n', bytes([0, 1, 0, 0, time]), time)
            writer.sync()
    reader = BagReader(tmp_path / 'bag')
    count = len(list(tmp_path.glob('bag/*.mcap')))
    files = [tmp_path / 'bag' / f'bag_{number}.mcap' for number in range(count)]
    assert count > 2
    # Besides its messages a full file holds the summary and an index.
    assert all(4096 <= file.stat().st_size < 4096 + 8192 for file in files[:-1])
    assert [(m.log_time, m.cdr[4]) for m in reader] == [(i, i) for i in times]


def test_bag_without_metadata_is_read_in_file_order(record, messages):
    # 'ros2 bag record' writes metadata.yaml last; killed, it leaves none.
    path = record(sync_each=True, max_bytes=1024)
    assert (path / 'bag_9.mcap').exists()
    (path / 'metadata.yaml').write_text('rosbag2_bagfile_inf')
    reader = BagReader(path)
    assert list(reader) == messages
    assert reader.losses[0].file == path / 'metadata.yaml'
    assert reader.metadata is None
    (path / 'metadata.yaml').unlink()
    assert list(BagReader(path)) == messages


@pytest.mark.parametrize('content', [None, b'something else'])
def test_missing_or_foreign_file_is_reported(record, messages, content):
    path = record(sync_each=True, max_bytes=1024)
    file = path / 'bag_1.mcap'
    lost = list(BagReader(file))
    file.unlink()
    if content:
        file.write_bytes(content)
    reader = BagReader(path)
    assert list(reader) == [each for each in messages if each not in lost]
    (loss,) = reader.losses
    assert (loss.file, loss.size) == (file, len(content or b''))


@pytest.mark.parametrize('mode', [CompressionMode.NONE, CompressionMode.FILE])
def test_another_storage_is_rejected(tmp_path, mode):
    """A bag of rosbags in MCAP is read by test_session_copied_by_another_tool_replays."""
    store, path = get_typestore(Stores.ROS2_JAZZY), tmp_path / 'other'
    writer = Writer(path, version=9, storage_plugin=StoragePlugin.SQLITE3)
    writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        connection = writer.add_connection('/x', FLOAT, typestore=store)
        writer.write(connection, 1, store.serialize_cdr(store.types[FLOAT](data=0.25), FLOAT))
    with pytest.raises(BagError, match='ros2 bag convert') as caught:
        BagReader(path)
    assert caught.value.code == 'other_storage'


@pytest.mark.parametrize('name', [FLOAT, 'demo_msgs/msg/Graded'])
def test_type_that_is_not_of_jazzy_is_not_decoded(tmp_path, name):
    """A Float64 with other fields is refused, not read as ours, which would be nonsense."""
    path = tmp_path / 'other.mcap'
    write_one(path, name, {'topic_type_hash': 'RIHS01_' + 64 * '0'}, bytes(16))
    reader = BagReader(path)
    with pytest.raises(BagError, match=r'must (have the .*Float64 of|be one of) ROS 2 Jazzy; got'):
        reader.deserialize(next(iter(reader)))


def test_big_endian_messages_are_read(tmp_path):
    """The second byte of CDR tells the order of all others; 0.25 is 0x3fd0 0000 0000 0000."""
    little, big = bytes([0, 1, 0, 0]), bytes([0, 0, 0, 0])
    with BagWriter(tmp_path / 'bag') as writer:
        writer.add_topic('/x', FLOAT)
        writer.write('/x', little + bytes(6) + b'\xd0\x3f', 0)
        writer.write('/x', big + b'\x3f\xd0' + bytes(6), 1)
    assert values(BagReader(tmp_path / 'bag')) == [0.25, 0.25]


def test_chunks_that_overlap_in_time_are_read_one_at_a_time(tmp_path):
    """Each of 30 chunks of zeros has its last message after the first of every other."""
    path = tmp_path / 'small.mcap'
    with path.open('wb') as file:
        writer = mcap.writer.Writer(file, chunk_size=2**23)
        writer.start('ros2')
        channel = writer.register_channel('/n', 'cdr', writer.register_schema('a/b', '', b''))
        for number in range(30):
            for log_time in (number, 1000 + number):
                writer.add_message(channel, log_time, bytes(2**20), log_time)
            writer.flush()
        writer.finish()
    assert path.stat().st_size < 100_000
    tracemalloc.start()
    try:
        assert sum(1 for _ in BagReader(path)) == 60
        assert tracemalloc.get_traced_memory()[1] < 2**25
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize('messages', [(), (bytes(8),)])
def test_file_without_messages_spans_no_time(tmp_path, messages):
    path = tmp_path / 'other.mcap'
    write_one(path, FLOAT, {}, *messages)
    reader = BagReader(path)
    assert values(reader) == len(messages) * [0.0]
    assert reader.span == ((1, 1) if messages else None)
    assert reader.losses == ()
