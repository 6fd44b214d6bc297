# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A session recorded by the running node holds what it published, and replays to the bit.

The bag is read by `rosbags`, which shares no code with our writer; what was published is what a
subscriber received over DDS.
"""

import signal
from collections import defaultdict

from closed_bag import check_closed
from nodes import end_node
from rclpy.serialization import serialize_message
from robot import Robot
from rosbags.typesys import Stores, get_typestore

from mlmem import UNDECODABLE
from mlmem.instrument.end import End
from mlmem_ros.bag.reader import BagReader
from mlmem_ros.contract.streams import STREAMS
from mlmem_ros.session.data import load_session
from mlmem_ros.session.replay import run_replay
from mlmem_ros.testing import assert_replays
from mlmem_tools.cli.main import main

EVERY_ONE = ('level', 'content', 'outcome', 'echo')
"""Topics of which a subscriber receives every message."""

PERIODIC = ('range', 'joint_states', 'field', 'wall')
"""Fast topics: a subscriber may miss messages, but receives none that was not recorded."""

CONTENT = 'diagnostic_msgs/msg/DiagnosticStatus'
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
    contents = [STORE.deserialize_cdr(cdr, CONTENT).message for cdr in found['/mlmem/content']]
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
    robot = start_robot(recorded, name='killed', apart=True)
    assert robot.write(1).success
    robot.wait(lambda: load_session(bag).outcomes, 'a synced chunk with the outcome')
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
    assert_replays(bag, incomplete=True).assert_levels([1])
    assert start_robot(kept, name='again').trigger('read')['level'] == 1
