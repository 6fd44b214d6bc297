# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whether a bag was closed properly, by readers that share no code with our writer."""

import yaml
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader


def check_closed(bag):
    """Assert that a bag is whole and closed; return its messages: topic, time, message."""
    metadata = yaml.safe_load((bag / 'metadata.yaml').read_text())
    metadata = metadata['rosbag2_bagfile_information']
    (name,) = metadata['relative_file_paths']
    with (bag / name).open('rb') as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None  # which is written last
        in_file = sum(1 for _ in reader.iter_messages())
    with AnyReader([bag]) as reader:
        messages = [
            (connection.topic, time, reader.deserialize(data, connection.msgtype))
            for connection, time, data in reader.messages()
        ]
    counts = {summary.statistics.message_count, in_file, len(messages), metadata['message_count']}
    assert len(counts) == 1
    assert metadata['message_count'] > 0
    assert metadata['files'][0]['message_count'] == metadata['message_count']
    first = metadata['starting_time']['nanoseconds_since_epoch']
    assert first == min(time for _, time, _ in messages)
    assert metadata['duration']['nanoseconds'] == max(time for _, time, _ in messages) - first
    return messages
