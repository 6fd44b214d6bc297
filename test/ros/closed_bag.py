# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whether a bag was closed properly, by readers that share no code with our writer."""

from mcap.reader import make_reader
from rosbags.highlevel import AnyReader


def check_closed(bag):
    """Assert that a bag of one file is whole; return its messages: topic, time, message."""
    (file,) = bag.glob('*.mcap')
    with file.open('rb') as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None  # which is written last
        in_file = sum(1 for _ in reader.iter_messages())
    with AnyReader([bag]) as reader:
        messages = [
            (connection.topic, time, reader.deserialize(data, connection.msgtype))
            for connection, time, data in reader.messages()
        ]
        in_metadata = reader.message_count
        times = [time for _, time, _ in messages]
        assert (reader.start_time, reader.end_time - 1) == (min(times), max(times))
    assert {summary.statistics.message_count, in_file, in_metadata} == {len(messages)}
    return messages
