# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A stream is described once: publishing, recording, replay, page and policy follow."""

import math

import numpy as np
import reference
from nodes import QUICK
from robot import Robot

from mlmem import Outcome
from mlmem_ros.contract.streams import STREAMS, Stream
from mlmem_ros.contract.topics import Qos
from mlmem_ros.session.data import load_session
from mlmem_ros.session.replay import run_replay
from mlmem_ros.testing import memory_node


def add_stream(monkeypatch, name, type_, values, **more):
    """Add a stream of the procedures that end: the only entry that it needs."""
    stream = Stream(name, type_, Qos.LATCHED, 'numbers', when=(Outcome,), values=values, **more)
    monkeypatch.setitem(STREAMS, stream.name, stream)


NEW_STREAMS = {
    'odd': ('std_msgs/msg/Bool', lambda ticks: ticks % 2 == 1),
    'weeks': ('std_msgs/msg/Float64', lambda ticks: ticks / 7.0),
    'texts': ('std_msgs/msg/String', lambda ticks: f'{ticks} ticks'),
    'stamped': (
        'sensor_msgs/msg/Temperature',
        lambda ticks: {'temperature': ticks / 7.0, 'variance': math.nan},
    ),
    'array': ('std_msgs/msg/Float64MultiArray', lambda ticks: np.array([float(ticks), 0.5])),
}
"""The type of each, and its values from the ticks that a procedure took."""


def test_new_stream_of_any_type_is_recorded_and_compared(monkeypatch, tmp_path):
    def add_streams(more_ticks):
        for name, (type_, values) in NEW_STREAMS.items():
            more = {'dimensions': (('number', -1),)} if name == 'array' else {}
            add_stream(
                monkeypatch, name, type_,
                lambda _, outcome, values=values: values(outcome.ticks + more_ticks), **more,
            )  # fmt: skip

    add_streams(0)
    path = str(tmp_path / 'session')
    with memory_node(QUICK | {'record.path': path}, name='streams') as node:
        ticks = node.memory.write(1).wait().ticks
        with Robot(node.element) as robot:
            messages = {name: robot.latest(name) for name in NEW_STREAMS}
        node.memory.read().wait()
    stamped = messages.pop('stamped')
    assert stamped.header.frame_id == 'streams'
    assert stamped.header.stamp.sec > 0
    assert stamped.temperature == ticks / 7.0
    assert messages['array'].layout.dim[0].label == 'number'
    for name, message in messages.items():
        assert np.array_equal(message.data, NEW_STREAMS[name][1](ticks)), name
    session = load_session(path)
    report = run_replay(session)
    assert report.exact
    for name in NEW_STREAMS:
        assert (report.events[name].recorded, report.events[name].equal) == (2, 2), name
    add_streams(1)
    changed = run_replay(session)
    assert set(changed.other_events) == {f'~/{name}' for name in NEW_STREAMS}
    assert not changed.passed


def test_new_stream_is_in_the_page_and_the_policy(monkeypatch):
    type_ = 'std_msgs/msg/Float64MultiArray'
    add_stream(monkeypatch, 'energies', type_, None, dimensions=(('number', -1),))
    page = reference.place_parts('interfaces.md', reference.PAGE_PARTS['interfaces.md']())
    assert '| `~/energies` | std_msgs/Float64MultiArray |' in page
    assert '<topic>~/energies</topic>' in reference.policy()
    assert 'energies' not in reference.POLICY.read_text(encoding='utf-8')
