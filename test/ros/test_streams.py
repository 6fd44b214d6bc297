# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A stream is described once: publishing, recording, replay, page and policy follow."""

import math

import numpy as np
import pytest
import reference
from nodes import QUICK
from robot import Robot

from mlmem import Outcome
from mlmem_ros.contract.streams import STREAMS, Stream
from mlmem_ros.contract.topics import Qos
from mlmem_ros.session.data import load_session
from mlmem_ros.session.replay import run_replay
from mlmem_ros.testing import memory_node


def add_stream(monkeypatch, type_, values, **more):
    """Add a stream of the procedures that end: the only entry that it needs."""
    stream = Stream(
        'energies', type_, Qos.LATCHED, 'numbers', when=(Outcome,), values=values, **more
    )
    monkeypatch.setitem(STREAMS, stream.name, stream)


@pytest.mark.parametrize(
    ('type_', 'values'),
    [
        ('std_msgs/msg/Bool', lambda ticks: ticks % 2 == 1),
        ('std_msgs/msg/Float64', lambda ticks: ticks / 7.0),
        ('std_msgs/msg/String', lambda ticks: f'{ticks} ticks'),
        (
            'sensor_msgs/msg/Temperature',
            lambda ticks: {'temperature': ticks / 7.0, 'variance': math.nan},
        ),
        ('std_msgs/msg/Float64MultiArray', lambda ticks: np.array([float(ticks), 0.5])),
    ],
    ids=['Bool', 'Float64', 'String', 'stamped', 'array'],
)
def test_new_stream_of_any_type_is_recorded_and_compared(monkeypatch, tmp_path, type_, values):
    more = {'dimensions': (('number', -1),)} if 'Array' in type_ else {}
    add_stream(monkeypatch, type_, lambda _, outcome: values(outcome.ticks), **more)
    path = str(tmp_path / 'session')
    with memory_node(QUICK | {'record.path': path}, name='streams') as node:
        expected = values(node.memory.write(1).wait().ticks)
        with Robot(node.element) as robot:
            message = robot.latest('energies')
        node.memory.read().wait()
    if hasattr(message, 'header'):
        assert message.header.frame_id == 'streams'
        assert message.header.stamp.sec > 0
        assert message.temperature == expected['temperature']
    else:
        assert np.array_equal(message.data, expected)
    if more:
        assert message.layout.dim[0].label == 'number'
    session = load_session(path)
    report = run_replay(session)
    assert report.exact
    assert (report.events['energies'].recorded, report.events['energies'].equal) == (2, 2)
    add_stream(monkeypatch, type_, lambda _, outcome: values(outcome.ticks + 1), **more)
    changed = run_replay(session)
    assert changed.other_events == ['~/energies']
    assert not changed.passed


def test_new_stream_is_in_the_page_and_the_policy(monkeypatch):
    add_stream(monkeypatch, 'std_msgs/msg/Float64MultiArray', None, dimensions=(('number', -1),))
    page = reference.place_parts('interfaces.md', reference.PAGE_PARTS['interfaces.md']())
    assert '| `~/energies` | std_msgs/Float64MultiArray |' in page
    assert '<topic>~/energies</topic>' in reference.policy()
    assert 'energies' not in reference.POLICY.read_text(encoding='utf-8')


def test_messages_of_an_idle_element_have_own_stamps(robot):
    heard = [robot.next('joint_states', lambda state: state.velocity[1] == 0.0) for _ in range(3)]
    assert len({str(state.header.stamp) for state in heard}) == len(heard)
