# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A session recorded by the running node holds what it published, and replays to the bit.

The bag is read by `rosbags`, which shares no code with our writer; what was published is what a
subscriber received over DDS.
"""

import signal

import pytest
from nodes import arrived
from robot import OUT, Robot
from rosbags.highlevel import AnyReader

from mlmem import UNDECODABLE
from mlmem.instrument.end import End
from mlmem_ros.bag.reader import BagReader
from mlmem_ros.session.data import load_session
from mlmem_ros.session.replay import run_replay
from mlmem_ros.testing import assert_replays
from mlmem_tools.cli.main import main

EVERY_ONE = ('level', 'content', 'outcome', 'echo')
"""Topics of which a subscriber receives every message."""

STREAMS = ('range', 'joint_states', 'field', 'wall')
"""Fast topics: a subscriber may miss messages, but receives none that was not recorded."""

ECHOES = 5
"""Of a write to a blank element and a read: one of no wall, then from both ends twice."""


def values(message):
    """Return a message of rclpy or of rosbags as plain values."""
    if hasattr(message, 'get_fields_and_field_types'):
        names = message.get_fields_and_field_types()
    elif hasattr(message, '__dataclass_fields__'):
        names = [
            name for name in message.__dataclass_fields__ if name.islower() and name[0] != '_'
        ]
    elif isinstance(message, bytes):
        return message[0]  # rclpy's byte
    elif hasattr(message, 'tolist'):
        return message.tolist()
    elif isinstance(message, (list, tuple)):
        return [values(item) for item in message]
    else:
        return message
    return {name: values(getattr(message, name)) for name in names}


def recorded(bag):
    """Return every message of every topic, decoded by rosbags."""
    found = {}
    with AnyReader([bag]) as reader:
        for connection, _, data in reader.messages():
            message = values(reader.deserialize(data, connection.msgtype))
            found.setdefault(connection.topic, []).append(message)
    return found


@pytest.fixture
def session(start, tmp_path):
    """Write level 1 and read it while a session is recorded; return bag and received messages."""
    bag = tmp_path / 'session'
    node = start({'record.path': str(bag), 'record.hash_every': 50})
    with Robot() as robot:
        heard = {topic: robot.received(topic) for topic in OUT if not topic.startswith('/')}
        # The node sends nothing, not even an echo, before it knows of the subscribers.
        robot.wait(lambda: all(heard[topic] for topic in STREAMS[1:]), 'the steady streams')
        assert robot.write(1).success
        assert robot.trigger('read').success
        robot.wait(lambda: len(heard['outcome']) >= 2, 'both outcomes')
        robot.wait(lambda: len(heard['echo']) >= ECHOES, 'the echoes: long, they take longer')
        robot.publish('strain', 0.001)
        robot.latest('content', lambda status: status.message.endswith('strained by hand'))
        robot.latest('level', lambda level: level.data == UNDECODABLE)
        with Robot() as late:
            assert late.latest('level').data == UNDECODABLE
            assert late.latest('content') == robot.latest('content')
        assert robot.trigger('abort').success
        for topic in ('level', 'content'):  # of which a node that ends sends no more
            robot.wait(lambda topic=topic: len(heard[topic]) == 4, f'the {topic} after the abort')
        node.terminate()
        assert node.exit_status() == 0
    return bag, {topic: [values(m) for m in messages] for topic, messages in heard.items()}


def test_session_holds_what_was_published_and_replays(session):
    bag, heard = session
    found = recorded(bag)
    for topic in EVERY_ONE:
        assert found[f'/mlmem/{topic}'] == heard[topic], topic
        assert heard[topic], topic
    for topic in STREAMS:
        assert heard[topic], topic
        rest = iter(found[f'/mlmem/{topic}'])  # a subsequence, in order
        for message in heard[topic]:
            assert any(_same(message, other) for other in rest), topic
    assert [content['message'] for content in found['/mlmem/content'][:2]] == ['level 1'] * 2
    assert found['/mlmem/content'][2]['message'].startswith('unknown since tick ')
    report = run_replay(load_session(bag))
    assert report.exact
    assert report.events['content'].equal == report.events['content'].recorded == 4
    assert report.hashes >= 10
    assert report.levels == [-1, 1, 1, 1, 1]  # a wall is heard from both ends
    assert len(heard['echo']) == ECHOES
    commands = contents = 0
    for message in BagReader(bag).messages():
        commands += message.topic.endswith('/session/command')
        contents += message.topic == '/mlmem/content'
        assert commands >= contents  # a file cut anywhere has the command of every event in it


def test_session_holds_the_shots_of_a_survey(start, tmp_path):
    """They are what `mlmem fit` takes."""
    bag = tmp_path / 'session'
    node = start({'element': 'bits_1', 'record.path': str(bag)})
    with Robot(node.element) as robot:
        shots = robot.trigger('survey')['shots']
    node.terminate()
    assert node.exit_status() == 0
    session = load_session(bag)
    assert len(session.shots) == shots > 5
    assert {shot.end for shot in session.shots} == set(End)
    assert run_replay(session).exact


def test_kill_loses_no_acknowledged_write(start, tmp_path, capsys):
    bag = tmp_path / 'session'
    kept = {'state.path': str(tmp_path / 'element.json')}
    node = start(
        {**kept, 'record.path': str(bag), 'record.sync_interval': 0.1}, name='killed', apart=True
    )
    with Robot(node.element) as robot:
        assert robot.write(1).success
        robot.wait(lambda: load_session(bag).outcomes, 'a synced chunk with the outcome')
        node.signal(signal.SIGKILL)
        node.exit_status()
    survived = load_session(bag)
    assert survived.header is not None
    report = run_replay(survived)
    assert report.levels_agree
    assert report.difference is None
    assert not report.whole  # its end is missing, and the report says so
    assert any('was not closed' in line for line in report.lost)
    mended = tmp_path / 'mended'
    assert main(['inspect', str(bag), '--repair', str(mended)]) == 0
    for each in (bag, mended):
        capsys.readouterr()
        assert main(['replay', str(each)]) == 1
        told = capsys.readouterr().out
        assert 'the end of the recording is missing; up to there, exact: the same bits' in told
        assert '0 bytes' not in told
        assert main(['replay', str(each), '--incomplete']) == 0
    assert_replays(mended, incomplete=True).assert_levels([1], incomplete=True)
    with Robot(start(kept, name='again').element) as robot:
        assert robot.trigger('read')['level'] == 1


def _same(one, other):
    """Compare values where infinities and NaN are equal to themselves."""
    return repr(one) == repr(other)


def test_session_is_started_and_stopped_by_service(start, tmp_path):
    bag = tmp_path / 'session'
    node = start()
    with Robot() as robot:
        assert robot.write(1).success
        robot.set(record__path=str(bag))
        assert robot.record(True)['path'] == str(bag)
        assert 'busy' in robot.record(True)['error']
        assert robot.trigger('read')['level'] == 1
        assert robot.record(False)['path'] == str(bag)
        assert 'nothing' in robot.record(False)['error']
        again = robot.record(True)['path']  # it never overwrites the first one
        assert again.startswith(str(bag))
        assert again != str(bag)
        assert robot.record(False).success
        robot.set(target_level=3)
        robot.pause(True)
        robot.send('write')
        arrived(node)
        assert 'write is running' in robot.record(True)['error']
    report = run_replay(load_session(bag))  # begun with the wall at level 1
    assert report.exact
    assert report.levels == [1, 1]
