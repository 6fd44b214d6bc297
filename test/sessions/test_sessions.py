# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which bags hold a session; those that were recorded long ago replay."""

import math
from pathlib import Path

import pytest
from rosbags.rosbag2 import Reader, StoragePlugin, Writer

from mlmem_ros.bag.errors import BagError
from mlmem_ros.session.data import load_session
from mlmem_ros.session.replay import find_difference, run_replay
from mlmem_ros.testing import assert_replays
from mlmem_tools.cli.main import main

from .tampering import Tampered

DATA = Path(__file__).parent.parent / 'data'
"""Golden sessions, recorded by a node in real time and run again without ROS:

    life            write 2, read, erase, come to rest, read
    manual_drive    write 0, then one level on by strain set by hand, read
    aborted_write   write 3, abort on the way, write 1, read

They were recorded with numpy 2.4 and numba 0.68 on a processor with AVX-512; a build that gives
other bits must still decode the same levels.
"""


def test_session_copied_by_another_tool_replays(tmp_path):
    writing = Writer(tmp_path / 'copy', version=9, storage_plugin=StoragePlugin.MCAP)
    with Reader(DATA / 'life') as reader, writing as writer:
        copies = {
            each.id: writer.add_connection(
                each.topic, each.msgtype, msgdef=each.msgdef.data, rihs01=each.digest
            )
            for each in reader.connections
        }
        for each, time, cdr in reader.messages():
            writer.write(copies[each.id], time, cdr)
    found = load_session(tmp_path / 'copy')
    assert (found.node, found.lost) == ('/mlmem', [])
    assert run_replay(found).exact


@pytest.mark.parametrize(
    ('bag', 'levels', 'done'),
    [
        ('life', [2, 2, -1], ['write', 'read', 'erase', 'read']),
        ('manual_drive', [0, 1], ['write', 'read']),
        ('aborted_write', [3, 3], ['write: aborted', 'abort', 'write', 'read']),
    ],
)
def test_golden_session_replays(bag, levels, done):
    session = assert_replays(DATA / bag)
    session.assert_levels(levels)
    assert session.report.states.compared >= 2
    assert session.report.refused == []
    outcomes = [f'{each.procedure}: {each.error}' for each in session.report.outcomes]
    assert [each.removesuffix(': ') for each in outcomes] == done


def test_replay_says_where_and_by_how_much_it_differs():
    """Move the first command by one tick: the bits differ from the next hash on."""
    session = load_session(DATA / 'life')
    tick, command = session.stamped[0]
    session.stamped[0] = (tick + 1, command)
    report = run_replay(session)
    assert not report.exact
    assert report.states.first_difference == next(h.tick for h in session.hashes if h.tick > tick)
    # One tick later under the same ramp: the wall's cells lag by up to some tenths of a cell.
    assert 1e-9 < report.states.difference < 2.5


def renamed(session, node):
    """Return a copy of a session of /mlmem as one of another node."""

    def rename(topic):
        return node + topic.removeprefix('/mlmem')

    return Tampered(
        {
            rename(name): type(info)(rename(name), info.type)
            for name, info in session.topics.items()
        },
        [each._replace(topic=rename(each.topic)) for each in session.messages],
    )


def test_session_that_takes_too_much_memory_is_rejected():
    with pytest.raises(BagError) as caught:
        load_session(DATA / 'life', max_bytes=10_000)
    assert caught.value.code == 'too_large'


def test_session_with_a_clock_set_back_is_exact(tmp_path):
    """As NTP steps a clock, half an hour back in the middle of a session."""
    whole = Tampered.read(DATA / 'life')
    middle = len(whole.messages) // 2
    whole.messages[middle:] = [
        message._replace(log_time=message.log_time - 1800 * 10**9)
        for message in whole.messages[middle:]
    ]
    whole.write(tmp_path / 'stepped')
    session = load_session(tmp_path / 'stepped')
    assert run_replay(session).exact
    times = [time for time, _ in session.outcomes]
    assert times == sorted(times)
    assert times[-1] < 60.0
    whole.messages.sort(key=lambda message: message.log_time)
    whole.write(tmp_path / 'sorted')
    with pytest.raises(BagError, match='a copy sorted by time cannot be replayed'):
        run_replay(load_session(tmp_path / 'sorted'))


def test_bag_without_a_session_is_rejected(tmp_path):
    made = renamed(Tampered.read(DATA / 'life'), '/talker')
    made.messages = [each for each in made.messages if each.topic == '/talker/level']
    made.topics = {'/talker/level': made.topics['/talker/level']}
    made.write(tmp_path / 'bag')
    with pytest.raises(BagError, match=r'must hold a session .*/talker/level'):
        load_session(tmp_path / 'bag')


def test_bag_of_several_nodes_needs_a_name(tmp_path):
    life = Tampered.read(DATA / 'life')
    both, other = renamed(life, '/robot/a'), renamed(life, '/b')
    both.topics |= other.topics
    both.messages += other.messages
    both.write(tmp_path / 'bag')
    with pytest.raises(BagError, match="'/b', '/robot/a'"):
        load_session(tmp_path / 'bag')
    found, whole = load_session(tmp_path / 'bag', '/robot/a'), load_session(DATA / 'life')
    assert (found.node, found.stamped) == ('/robot/a', whole.stamped)
    assert len(found.outcomes) == len(whole.outcomes)


def test_texts_from_a_bag_are_not_markup(tmp_path, capsys):
    """Names that rich would read as styles or an emoji, or that clear the terminal."""
    renamed(Tampered.read(DATA / 'life'), '/[/red]:smile:\x1b[2J').write(tmp_path / 'bag')
    assert main(['inspect', str(tmp_path / 'bag')]) == 0
    told = capsys.readouterr().out
    assert '/[/red]:smile:\\x1b[2J' in told
    assert '\x1b' not in told


@pytest.mark.parametrize('computed', [{'a': 1.0}, {'a': 1.0, 'b': 2.0, 'c': 0.0}, {}])
def test_difference_of_other_fields_is_infinite(computed):
    recorded = {'a': 1.0, 'b': 2.0}
    assert find_difference(recorded, computed) == math.inf
    assert find_difference(recorded, {'a': 1.0, 'b': 2.5}) == 0.5
