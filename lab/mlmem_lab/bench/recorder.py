# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Recording: our writer and recorder compared with rosbags' writer and the plain one of `mcap`.

All write the same messages into MCAP with zstd chunks. Only ours keep a CRC of every chunk, and
only our recorder also syncs to the disk, with a `metadata.yaml` that agrees with the last sync.
The input is a recorded session of the tests, over and over.
"""

from __future__ import annotations

import shutil
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from functools import partial
from pathlib import Path

import numpy as np

from mlmem_ros.bag import jazzy
from mlmem_ros.bag.contents import Message
from mlmem_ros.bag.reader import BagReader
from mlmem_ros.bag.writer import BagWriter
from mlmem_ros.host import SessionPlan, ThrottledLog
from mlmem_ros.host.recording import BagRecording
from mlmem_ros.host.settings import RecordSettings

from .measure import Contender, ResultTable, compare_costs, format_number, measure_contenders

Types = Mapping[str, str]
"""Message types by topic."""

Put = Callable[[Message], object]
Opened = Callable[[Path, Types], AbstractContextManager[Put]]


def repeat_session(times: int) -> list[Message]:
    """Return the messages of a recorded session, so many times one after the other."""
    reader = BagReader(Path(__file__).parents[3] / 'test' / 'data' / 'life')
    assert reader.span is not None
    period = reader.span[1] - reader.span[0] + 1
    messages = list(reader)
    return [
        each._replace(log_time=each.log_time + number * period)
        for number in range(times)
        for each in messages
    ]


def run(repeats: int) -> ResultTable:
    """Measure the throughput of every writer."""
    messages = repeat_session(20)
    size = sum(len(message.cdr) for message in messages) / 1e6
    writers: dict[str, Opened] = {
        'BagWriter (ours)': _open_bag_writer,
        'Recorder (ours, threaded)': _open_recorder,
        'rosbags Writer': _open_rosbags,
        'mcap Writer': _open_mcap,
    }
    with tempfile.TemporaryDirectory() as folder:
        bag = Path(folder) / 'bag'
        contenders = [
            Contender(name, partial(_write_bag, messages, opened, bag), len(messages))
            for name, opened in writers.items()
        ]
        costs = measure_contenders(contenders, repeats, scale=1e6)
    rows = compare_costs(contenders, costs, 'us / message')
    for row, own in zip(rows, costs, strict=True):
        rate = 1e6 / float(np.median(own))
        row['messages/s'] = format_number(rate)
        row['MB/s'] = format_number(rate * size / len(messages))
    caption = (
        f'{len(messages)} messages ({size:.1f} MB) from opening to closing the bag; MCAP, zstd'
    )
    return ResultTable('Recorder: as fast as possible', caption, rows)


def _write_bag(messages: Sequence[Message], opened: Opened, bag: Path) -> None:
    """Write a bag, as fast as possible, and remove it."""
    with opened(bag, {message.topic: message.type for message in messages}) as put:
        for message in messages:
            put(message)
    shutil.rmtree(bag, ignore_errors=True)


@contextmanager
def _open_recorder(path: Path, types: Types) -> Iterator[Put]:
    plan, log = SessionPlan('/mlmem', RecordSettings()), ThrottledLog(lambda *_: None)
    recorder = BagRecording(plan, log, time.time_ns, _open_bag(path, types), ())
    yield lambda message: recorder.keep_message((message.topic, message.cdr, message.log_time))
    recorder.close()
    assert recorder.error is None
    assert recorder.dropped == 0


@contextmanager
def _open_bag_writer(path: Path, types: Types) -> Iterator[Put]:
    with _open_bag(path, types) as writer:
        yield lambda message: writer.write(message.topic, message.cdr, message.log_time)


def _open_bag(path: Path, types: Types) -> BagWriter:
    writer = BagWriter(path)
    for topic, kind in types.items():
        writer.add_topic(topic, kind)
    return writer


@contextmanager
def _open_rosbags(path: Path, types: Types) -> Iterator[Put]:
    from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    writer = Writer(path, version=9, storage_plugin=StoragePlugin.MCAP)
    writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    with writer:
        added = {t: writer.add_connection(t, kind, typestore=store) for t, kind in types.items()}
        yield lambda message: writer.write(added[message.topic], message.log_time, message.cdr)


@contextmanager
def _open_mcap(path: Path, types: Types) -> Iterator[Put]:
    from mcap.writer import Writer

    path.mkdir()
    with (path / 'bag.mcap').open('wb') as file:
        writer = Writer(file)
        writer.start('ros2')
        channels = {}
        for topic, kind in types.items():
            text = jazzy.find_definition(kind).text.encode()
            schema = writer.register_schema(kind, 'ros2msg', text)
            channels[topic] = writer.register_channel(topic, 'cdr', schema)
        yield lambda message: writer.add_message(
            channels[message.topic], message.log_time, message.cdr, message.log_time
        )
        writer.finish()
