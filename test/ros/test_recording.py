# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A session recorded by the running node holds what it published, and replays to the bit.

The bag is read by `rosbags`, which shares no code with our writer; what was published is what a
subscriber received over DDS.
"""

import math
import signal
from collections import defaultdict

import numpy as np
import reference
from nodes import check_closed, check_node, end_node
from rclpy.serialization import serialize_message
from robot import Robot
from rosbags.typesys import Stores, get_typestore

from mlmem import UNDECODABLE, Outcome
from mlmem.instrument.end import End
from mlmem_ros.bag.reader import BagReader
from mlmem_ros.contract.streams import STREAMS, Stream
from mlmem_ros.contract.topics import Qos
from mlmem_ros.session.data import load_session
from mlmem_ros.session.replay import run_replay
from mlmem_ros.testing import assert_replays
from mlmem_tools.cli.main import main

EVERY_ONE = ('level', 'content', 'outcome', 'echo')
"""Topics of which a subscriber receives every message."""

PERIODIC = ('range', 'joint_states', 'field', 'wall')
"""Fast topics: a subscriber may miss messages, but receives none that was not recorded."""

ECHOES = 5
"""Of a write to a blank element and a read: one of no wall, then from both ends twice."""

STORE = get_typestore(Stores.ROS2_JAZZY)
"""The types of rosbags."""


def encode(cdr, kind):
    """Return a message as rosbags encodes it: equal messages have equal bytes, NaN included."""
    return bytes(STORE.serialize_cdr(STORE.deserialize_cdr(cdr, kind), kind))


def test_session_holds_what_was_published_and_replays(start_robot, tmp_path):
    """Level 1 is written and read, and the element strained by hand."""
    bag = tmp_path / 'session'
    robot = start_robot({'record.path': str(bag), 'record.hash_every': 50})
    heard = {topic: robot.received(topic) for topic in (*EVERY_ONE, *PERIODIC)}
    # The node sends nothing, not even an echo, before it knows of the subscribers.
    robot.wait(lambda: all(heard[topic] for topic in PERIODIC[1:]), 'the steady streams')
    assert robot.write(1).success
    assert robot.trigger('read').success
    robot.wait(lambda: len(heard['outcome']) >= 2, 'both outcomes')
    robot.wait(lambda: len(heard['echo']) >= ECHOES, 'the echoes: long, they take longer')
    robot.publish('strain', data=0.001)
    robot.latest('content', lambda status: status.message.endswith('strained by hand'))
    robot.latest('level', lambda level: level.data == UNDECODABLE)
    with Robot() as late:
        assert late.latest('level').data == UNDECODABLE
        assert late.latest('content') == robot.latest('content')
    assert robot.trigger('abort').success
    for topic in ('level', 'content'):  # of which a node that ends sends no more
        robot.wait(lambda topic=topic: len(heard[topic]) == 4, f'the {topic} after the abort')
    end_node(robot.memory)
    assert all(heard.values())
    published = {
        topic: [encode(serialize_message(message), STREAMS[topic].type) for message in messages]
        for topic, messages in heard.items()
    }
    found = defaultdict(list)
    for topic, _, message in check_closed(bag):
        found[topic].append(bytes(STORE.serialize_cdr(message, message.__msgtype__)))
    for topic in EVERY_ONE:
        assert found[f'/mlmem/{topic}'] == published[topic], topic
    for topic in PERIODIC:
        rest = iter(found[f'/mlmem/{topic}'])  # a subsequence, in order
        assert all(message in rest for message in published[topic]), topic
    contents = [status.message for status in heard['content']]
    assert contents[:2] == ['level 1'] * 2
    assert contents[2].startswith('unknown since tick ')
    report = run_replay(load_session(bag))
    assert report.exact
    assert report.events['content'].equal == report.events['content'].recorded == 4
    assert report.states.compared >= 10
    assert report.endings == report.recorded_endings
    assert len(heard['echo']) == ECHOES
    commands = contents = 0
    for message in BagReader(bag):
        commands += message.topic.endswith('/session/command')
        contents += message.topic == '/mlmem/content'
        assert commands >= contents  # a file cut anywhere has the command of every event in it


def test_session_holds_the_shots_of_a_survey(start_robot, tmp_path):
    """They are what `mlmem fit` takes."""
    bag = tmp_path / 'session'
    robot = start_robot({'element': 'bits_1', 'record.path': str(bag)})
    shots = robot.trigger('survey')['shots']
    end_node(robot.memory)
    session = load_session(bag)
    assert len(session.shots) == shots > 5
    assert {shot.end for shot in session.shots} == set(End)
    assert run_replay(session).exact


def test_kill_loses_no_acknowledged_write(start_robot, tmp_path, capsys):
    bag = tmp_path / 'session'
    kept = {'state.path': str(tmp_path / 'element.json')}
    recorded = {**kept, 'record.path': str(bag), 'record.sync_interval': 0.1}
    robot = start_robot(recorded, name='killed', namespace='/arm', apart=True)
    check_node(robot.memory, '/arm/killed')
    assert robot.write(1).success
    robot.wait(lambda: len(load_session(bag).outcomes) > 2, 'a synced chunk with the outcome')
    robot.memory.signal(signal.SIGKILL)
    robot.memory.exit_status()
    report = run_replay(load_session(bag))
    assert report.levels_agree
    assert report.states.exact
    assert not report.whole  # its end is missing, and the report says so
    assert any('was not closed' in line for line in report.lost)
    assert main(['inspect', str(bag)]) == 1
    capsys.readouterr()
    assert main(['replay', str(bag)]) == 1
    output = capsys.readouterr().out
    assert 'the end of the recording is missing; up to there, exact: the same bits' in output
    assert '0 bytes' not in output
    assert main(['replay', str(bag), '--incomplete']) == 0
    assert_replays(bag, incomplete=True).assert_levels([0, 0, 1])
    assert start_robot(kept, name='again').trigger('read')['level'] == 1


# A stream is described once: publishing, recording, replay, page and policy follow


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


def test_new_stream_of_any_type_is_recorded_and_compared(monkeypatch, start_robot, tmp_path):
    def add_streams(more_ticks):
        for name, (type_, values) in NEW_STREAMS.items():
            more = {'dimensions': (('number', -1),)} if name == 'array' else {}
            add_stream(
                monkeypatch, name, type_,
                lambda _, outcome, values=values: values(outcome.ticks + more_ticks), **more,
            )  # fmt: skip

    add_streams(0)
    path = str(tmp_path / 'session')
    robot = start_robot({'record.path': path}, name='streams')
    ticks = robot.write(1)['ticks']
    messages = {name: robot.latest(name) for name in NEW_STREAMS}
    assert robot.trigger('read').success
    end_node(robot.memory)
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
