# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A small bag and its messages, for every test that needs one."""

import pytest

from mlmem_ros.bag import jazzy
from mlmem_ros.bag.contents import Message
from mlmem_ros.bag.writer import BagWriter

LEVEL = '/mlmem/level', 'std_msgs/msg/Int16'
RANGE = '/mlmem/range', 'std_msgs/msg/Float64'
PROBE = '/mlmem/probe', 'std_msgs/msg/Empty'


@pytest.fixture
def messages():
    """Forty-five messages on three topics, 0.1 s apart."""
    start, step = 1_700_000_000_000_000_000, 100_000_000
    made = []
    for i in range(15):
        for topic, fields in ((LEVEL, {'data': i - 2}), (RANGE, {'data': i / 8}), (PROBE, {})):
            time = start + len(made) * step
            made.append(Message(*topic, time, jazzy.encode_message(topic[1], **fields)))
    return made


@pytest.fixture
def record(tmp_path, messages):
    """Record these messages into `tmp_path / 'bag'`; options go to the writer."""

    def record(name='bag', sync_each=False, **options):
        with BagWriter(tmp_path / name, **options) as writer:
            for topic, qos in (
                (LEVEL, {'durability': 'transient_local'}),
                (RANGE, {'reliability': 'best_effort'}),
                (PROBE, {}),
            ):
                writer.add_topic(*topic, **qos, begins_file=True)
            for message in messages:
                writer.write(message.topic, message.cdr, message.log_time)
                if sync_each:
                    writer.sync()
        return tmp_path / name

    return record
