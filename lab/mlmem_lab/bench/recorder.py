# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Recording: our writer and recorder compared with rosbags' writer and the plain one of `mcap`.

All write the same messages into MCAP with zstd chunks. Only ours keep a CRC of every chunk, and
only our recorder also syncs to the disk, with a `metadata.yaml` that agrees with the last sync.
The input is what a node records at four times the default rates.
"""

from __future__ import annotations

import json
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from mlmem.physics import CASE_II, NOH_BATHE, Chain, Specimen, substep_times
from mlmem.physics.equilibrium import find_pinned_wall
from mlmem.physics.potential import Array
from mlmem_ros.bag import jazzy
from mlmem_ros.bag.queued_writer import QueuedWriter
from mlmem_ros.bag.writer import BagWriter
from mlmem_ros.session.records import STRING_TYPE

from .measure import Contender, ResultTable, compare_costs, format_number, measure_contenders

MATRIX_TYPE = 'std_msgs/msg/Float32MultiArray'

TYPES_BY_TOPIC = {
    '/mlmem/field': MATRIX_TYPE,
    '/mlmem/wall': 'std_msgs/msg/Float64MultiArray',
    '/mlmem/joint_states': 'sensor_msgs/msg/JointState',
    '/mlmem/echo': MATRIX_TYPE,
    '/mlmem/level': 'std_msgs/msg/Int16',
    '/mlmem/session/state_hash': STRING_TYPE,
}


@dataclass(frozen=True)
class Message:
    """One message as a recorder gets it: topic, CDR and time in nanoseconds."""

    topic: str
    cdr: bytes
    time: int


def build_traffic(seconds: float) -> list[Message]:
    """Return the messages of a session: a wall that is strained, and one read a second."""
    chain = Chain(CASE_II, 0.25, NOH_BATHE)
    chain.place(find_pinned_wall(Specimen(CASE_II), 3))
    stream_every = 5  # ticks between two messages of the streams field, wall and joint_states
    steps = 80 * stream_every
    phase = substep_times(steps, chain.dt, NOH_BATHE)
    messages = []
    tick_ns = 2_000_000  # nanoseconds of a default tick
    echo_every = 500  # ticks between two reads, and between two hashes of the state
    for number in range(round(seconds * 1e9 / tick_ns / stream_every)):
        ticks = stream_every * (number + 1)
        time = tick_ns * ticks
        V_N = 2.0 * np.sin(1e-3 * (chain.time + phase))
        ends = chain.advance(V_N)
        messages += [
            _build_message('/mlmem/field', _build_array(chain.configuration), time),
            _build_message('/mlmem/wall', _build_array(np.array([100.3]), np.float64), time),
            _build_message('/mlmem/joint_states', _joint_states(chain, time), time),
        ]
        if ticks % echo_every == 0:
            echo = np.resize(ends[0], (3, 3200))
            v = [value.hex() for value in chain.v.tolist()]
            messages += [
                _build_message('/mlmem/echo', _build_array(echo), time),
                _build_message('/mlmem/level', {'data': 3}, time),
                _build_message('/mlmem/session/state_hash', {'data': json.dumps({'v': v})}, time),
            ]
    return messages


def _build_message(topic: str, fields: dict[str, Any], time: int) -> Message:
    return Message(
        topic, jazzy.serialize_message(jazzy.make_message(TYPES_BY_TOPIC[topic], **fields)), time
    )


def _build_array(values: Array, kind: type[np.floating[Any]] = np.float32) -> dict[str, Any]:
    size = values.size
    dimension = jazzy.make_message(
        'std_msgs/msg/MultiArrayDimension', label='cell', size=size, stride=size
    )
    layout = jazzy.make_message('std_msgs/msg/MultiArrayLayout', dim=[dimension], data_offset=0)
    return {'layout': layout, 'data': values.astype(kind).ravel()}


def _joint_states(chain: Chain, time: int) -> dict[str, Any]:
    stamp = jazzy.make_message(
        'builtin_interfaces/msg/Time', sec=time // 10**9, nanosec=time % 10**9
    )
    return {
        'header': jazzy.make_message('std_msgs/msg/Header', stamp=stamp, frame_id='mlmem'),
        'name': ['substrate', 'transducer'],
        'position': np.array([chain.V_N, chain.v[0]]),
        'velocity': np.array([0.0, chain.velocity[0]]),
        'effort': np.array([chain.V_N, 0.0]),
    }


TITLE = 'recording at four times the default rates'

Put = Callable[[Message], object]
Opened = Callable[[Path], AbstractContextManager[Put]]


def run(repeats: int) -> ResultTable:
    """Measure the throughput of every writer."""
    seconds = 20.0
    messages = build_traffic(seconds)
    size = sum(len(message.cdr) for message in messages) / 1e6
    with tempfile.TemporaryDirectory() as folder:
        contenders = [
            Contender(
                name, partial(_write_bag, messages, opened, Path(folder) / 'bag'), len(messages)
            )
            for name, opened in WRITERS_BY_NAME.items()
        ]
        costs = measure_contenders(contenders, repeats, scale=1e6)
    rows = compare_costs(contenders, costs, 'us / message')
    for row, own in zip(rows, costs, strict=True):
        rate = 1e6 / float(np.median(own))
        row['messages/s'] = format_number(rate)
        row['MB/s'] = format_number(rate * size / len(messages))
    caption = (
        f'{len(messages)} messages ({size:.1f} MB, {seconds:g} s of session) from opening to '
        'closing the bag; MCAP, zstd'
    )
    return ResultTable('Recorder: as fast as possible', caption, rows)


def _write_bag(messages: list[Message], opened: Opened, bag: Path) -> None:
    """Write a bag, as fast as possible, and remove it."""
    with opened(bag) as put:
        for message in messages:
            put(message)
    shutil.rmtree(bag, ignore_errors=True)


@contextmanager
def _open_recorder(path: Path) -> Iterator[Put]:
    recorder = QueuedWriter(_open_bag(path), dropped_topic='/mlmem/session/dropped')
    yield lambda message: recorder.put(message.topic, message.cdr, message.time)
    status = recorder.close()
    assert status.error is None
    assert status.dropped == 0


@contextmanager
def _bag_writer(path: Path) -> Iterator[Put]:
    with _open_bag(path) as writer:
        yield lambda message: writer.write(message.topic, message.cdr, message.time)


def _open_bag(path: Path) -> BagWriter:
    writer = BagWriter(path)
    for topic, kind in TYPES_BY_TOPIC.items():
        writer.add_topic(topic, kind)
    return writer


@contextmanager
def _open_rosbags(path: Path) -> Iterator[Put]:
    from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    writer = Writer(path, version=9, storage_plugin=StoragePlugin.MCAP)
    writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    with writer:
        added = {
            t: writer.add_connection(t, k, typestore=store) for t, k in TYPES_BY_TOPIC.items()
        }
        yield lambda message: writer.write(added[message.topic], message.time, message.cdr)


@contextmanager
def _open_mcap(path: Path) -> Iterator[Put]:
    from mcap.writer import Writer

    path.mkdir()
    with (path / 'bag.mcap').open('wb') as file:
        writer = Writer(file)
        writer.start('ros2')
        channels = {}
        for topic, kind in TYPES_BY_TOPIC.items():
            schema = writer.register_schema(
                kind, 'ros2msg', jazzy.find_definition(kind).text.encode()
            )
            channels[topic] = writer.register_channel(topic, 'cdr', schema)
        yield lambda message: writer.add_message(
            channels[message.topic], message.time, message.cdr, message.time
        )
        writer.finish()


WRITERS_BY_NAME: dict[str, Opened] = {
    'BagWriter (ours)': _bag_writer,
    'Recorder (ours, threaded)': _open_recorder,
    'rosbags Writer': _open_rosbags,
    'mcap Writer': _open_mcap,
}
