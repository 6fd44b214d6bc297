# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A bag directory is written as rosbag2 writes it, and every fault is one error."""

import os
import resource
import shutil

import pytest
from mcap.records import Chunk
from mcap.stream_reader import StreamReader
from rosbags.highlevel import AnyReader
from rosbags.interfaces import QosDurability

from mlmem_ros.bag import jazzy
from mlmem_ros.bag.contents import Message, parse_metadata
from mlmem_ros.bag.errors import BagError
from mlmem_ros.bag.reader import BagReader
from mlmem_ros.bag.writer import BagWriter


def level(i):
    return jazzy.encode_message('std_msgs/msg/Int16', data=i)


@pytest.fixture
def writer(tmp_path):
    """A bag with one topic, closed after the test."""
    with BagWriter(tmp_path / 'bag') as writer:
        writer.add_topic('/level', 'std_msgs/msg/Int16')
        yield writer


def test_sync_of_nothing_leaves_the_files_as_they_are(writer):
    writer.write('/level', level(1), 0)
    writer.sync()
    before = {file: file.stat() for file in writer.path.iterdir()}
    writer.sync()
    assert {file: file.stat() for file in writer.path.iterdir()} == before


@pytest.mark.parametrize(
    ('path', 'wrong'),
    [('whole', {}), ('file', {}), ('file/bag', {}), ('a\0b', {}), ('bag', {'max_bytes': 1023})],
    ids=str,
)
def test_bag_is_neither_overwritten_nor_created_wrong(record, tmp_path, path, wrong):
    """The path exists, or cannot be one, or a setting is wrong."""
    record('whole')
    (tmp_path / 'file').touch()
    before = {file: file.is_file() and file.read_bytes() for file in tmp_path.rglob('*')}
    with pytest.raises(BagError, match='exists already' if path in ('whole', 'file') else None):
        BagWriter(tmp_path / path, **wrong)
    assert {file: file.is_file() and file.read_bytes() for file in tmp_path.rglob('*')} == before


def test_unknown_type_is_rejected(writer):
    with pytest.raises(BagError, match="one of ROS 2 Jazzy; got 'no_msgs/msg/No'"):
        writer.add_topic('/no', 'no_msgs/msg/No')
    writer.write('/level', level(2), 0)
    writer.close()
    assert [m.cdr for m in BagReader(writer.path)] == [level(2)]


def test_closed_bag_takes_no_more(writer):
    writer.close()
    writer.close()  # once more does nothing
    for use in (lambda: writer.write('/level', level(1), 0), writer.sync):
        with pytest.raises(BagError, match='it is closed'):
            use()


def test_removed_directory_is_noticed_by_the_next_sync(writer):
    writer.write('/level', level(1), 0)
    writer.sync()
    shutil.rmtree(writer.path)
    writer.write('/level', level(2), 1)
    with pytest.raises(BagError, match='deleted while being written') as first:
        writer.sync()
    with pytest.raises(BagError) as second:
        writer.write('/level', level(3), 2)
    assert second.value is first.value  # one error, however often it is asked
    writer.close()  # quiet: the error has been told


def test_full_disk_leaves_what_was_synced(writer):
    # A limit on the size of files stands in for the disk: writing fails half way through.
    writer.add_topic('/noise', 'std_msgs/msg/ByteMultiArray')
    writer.write('/level', level(1), 0)
    writer.sync()
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (64 * 1024, hard))
    try:
        with pytest.raises(BagError, match=r'bag_0\.mcap: File too large'):
            writer.write('/noise', os.urandom(1 << 20), 1)
        writer.close()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    reader = BagReader(writer.path)
    assert list(reader) == [Message('/level', 'std_msgs/msg/Int16', 0, level(1))]
    assert 'truncated' in reader.losses[0].reason
    metadata = parse_metadata((writer.path / 'metadata.yaml').read_text())
    assert sum(metadata.message_counts.values()) == 1  # agrees with the last sync


def test_rosbags_reads_messages_and_qos(record, messages):
    with AnyReader([record(sync_each=True, max_bytes=1024)]) as reader:
        # It compares the hash of every type with the hash that it computes itself.
        found = [
            (each.topic, each.msgtype, time, raw, reader.deserialize(raw, each.msgtype))
            for each, time, raw in reader.messages()
        ]
        (latched,) = [each for each in reader.connections if each.topic == '/mlmem/level']
        assert latched.ext.offered_qos_profiles[0].durability == QosDurability.TRANSIENT_LOCAL
    assert [each[:4] for each in found] == [
        (each.topic, each.type, each.log_time, each.cdr) for each in messages
    ]
    assert [each.data for *_, each in found if hasattr(each, 'data')][:2] == [-2, 0.0]


def test_long_recording_is_cut_into_small_chunks(tmp_path):
    with BagWriter(tmp_path / 'long') as writer:
        writer.add_topic('/noise', 'std_msgs/msg/ByteMultiArray')
        for i in range(10):
            writer.write('/noise', bytes(100_000), i)  # 1 MB in chunks of at least 256 KiB
    path = tmp_path / 'long' / 'long_0.mcap'
    with path.open('rb') as stream:
        records = list(StreamReader(stream, validate_crcs=True, emit_chunks=True).records)
    assert [r.uncompressed_size // 100_000 for r in records if type(r) is Chunk] == [3, 3, 3, 1]
