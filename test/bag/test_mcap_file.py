# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Our MCAP files satisfy the reference reader, with every CRC checked."""

import pytest
from mcap.reader import NonSeekingReader, SeekingReader
from mcap.records import Chunk, Footer
from mcap.stream_reader import StreamReader

from mlmem_ros.bag import jazzy
from mlmem_ros.bag.errors import BagError
from mlmem_ros.bag.mcap_file import McapFile


def records(path, **options):
    with path.open('rb') as stream:
        return list(StreamReader(stream, validate_crcs=True, **options).records)


@pytest.mark.parametrize('reader_class', [SeekingReader, NonSeekingReader])
def test_the_reference_reader_reads_every_message(record, messages, reader_class):
    path = record() / 'bag_0.mcap'
    with path.open('rb') as stream:
        found = [
            (channel.topic, schema.name, m.log_time, m.publish_time, m.data)
            for schema, channel, m in reader_class(stream, validate_crcs=True).iter_messages()
        ]
    assert found == messages


def test_the_profile_is_ros2(record):
    assert records(record() / 'bag_0.mcap')[0].profile == 'ros2'


def test_the_index_leads_to_each_topic(record, messages):
    with (record() / 'bag_0.mcap').open('rb') as stream:
        found = [m.data for _, _, m in SeekingReader(stream).iter_messages(['/mlmem/range'])]
    assert found == [m.cdr for m in messages if m.topic == '/mlmem/range']


def test_statistics_count_what_was_written(record, messages):
    with (record(sync_each=True) / 'bag_0.mcap').open('rb') as stream:
        statistics = SeekingReader(stream).get_summary().statistics
    assert statistics.message_count == 30
    assert statistics.channel_message_counts == {1: 10, 2: 10, 3: 10}
    assert statistics.chunk_count == 30  # one for each sync
    assert statistics.schema_count == statistics.channel_count == 3
    assert statistics.metadata_count == 2  # as by rosbag2: at the start and at the end
    assert statistics.message_start_time == messages[0].log_time
    assert statistics.message_end_time == messages[-1].log_time


def test_chunks_have_a_crc(record):
    found = records(record(sync_each=True) / 'bag_0.mcap', emit_chunks=True)
    assert all(chunk.uncompressed_crc for chunk in found if type(chunk) is Chunk)


def test_a_long_recording_is_cut_into_small_chunks(tmp_path):
    file = McapFile(tmp_path / 'long.mcap')
    channel = file.add_channel(
        '/noise', jazzy.definition('std_msgs/msg/ByteMultiArray'), 'cdr', {}
    )
    for i in range(10):
        file.write(channel, bytes(100_000), i, i)  # 1 MB in chunks of at least 256 KiB
    file.close()
    found = records(tmp_path / 'long.mcap', emit_chunks=True)
    assert [r.uncompressed_size // 100_000 for r in found if type(r) is Chunk] == [3, 3, 3, 1]


def test_channels_carry_qos_and_hash(record):
    with (record() / 'bag_0.mcap').open('rb') as stream:
        channels = SeekingReader(stream).get_summary().channels
    assert {key for channel in channels.values() for key in channel.metadata} == {
        'offered_qos_profiles',
        'topic_type_hash',
    }
    assert 'durability: transient_local' in channels[1].metadata['offered_qos_profiles']
    assert channels[1].metadata['topic_type_hash'].startswith('RIHS01_1dcc3464')


def test_a_file_without_a_message_is_whole(tmp_path):
    McapFile(tmp_path / 'empty.mcap').close()
    with (tmp_path / 'empty.mcap').open('rb') as stream:
        assert list(SeekingReader(stream, validate_crcs=True).iter_messages()) == []
    assert type(records(tmp_path / 'empty.mcap')[-1]) is Footer


def test_an_existing_file_is_refused(tmp_path):
    (tmp_path / 'a.mcap').write_bytes(b'precious')
    with pytest.raises(BagError, match='File exists'):
        McapFile(tmp_path / 'a.mcap')
