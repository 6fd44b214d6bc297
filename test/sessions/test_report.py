# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A replay reports what it compared and what was missing; only a pass has exit status 0."""

import functools
import json
import math
import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from mlmem_ros.bag import jazzy
from mlmem_ros.bag.contents import TopicInfo
from mlmem_ros.bag.writer import BagWriter
from mlmem_ros.session.data import load_session
from mlmem_ros.session.replay import ReplayReport, find_difference, run_replay
from mlmem_ros.session.report import ComparedEvents, Difference
from mlmem_tools.cli.main import main

from .tampering import Tampered
from .test_replay import JAZZY, WRITE_LEVEL_1_THEN_PROBE, foreign_bag

pytest_plugins = ['mlmem_ros.testing']

ROOT = Path(__file__).parent.parent.parent
SESSION = ROOT / 'test' / 'data' / 'aborted_write'


@pytest.fixture(scope='module')
def session():
    """The session without the periodic streams, which no replay compares."""
    found = Tampered.read(SESSION)
    periodic = ('/mlmem/field', '/mlmem/wall', '/mlmem/joint_states')
    found.messages = [each for each in found.messages if each.topic not in periodic]
    return found


def copies(made, topic):
    """Return the places of a topic's messages."""
    return [n for n, each in enumerate(made.messages) if each.topic == f'/mlmem/{topic}']


def edit(made, index, change):
    """Change a message of a session."""
    message = jazzy.deserialize_message(made.messages[index].cdr, made.messages[index].type)
    change(message)
    made.messages[index] = made.messages[index]._replace(cdr=jazzy.serialize_message(message))


def with_header(session, path, **values):
    """Write a session with changes to its header, such as `settings__probe__sigma=9.0`."""

    def change(message):
        header = json.loads(message.data)
        for names, value in values.items():
            *groups, name = names.split('__')
            functools.reduce(dict.get, groups, header)[name] = value
        message.data = json.dumps(header)

    made = session.copy()
    for index in copies(made, 'session'):
        edit(made, index, change)
    made.write(path)
    return path


def replayed(capsys, *arguments):
    """Return the exit status of `mlmem replay` and its output, less the progress."""
    capsys.readouterr()
    status = main(['replay', *map(str, arguments)])
    told = capsys.readouterr()
    return status, told.out if status < 2 else told.err


@pytest.mark.parametrize('other_build', [True, False])
def test_replay_compares_texts_of_the_same_build_only(capsys, monkeypatch, other_build):
    """Another build may word or round outcomes otherwise."""
    versions = dict(load_session(SESSION).header.versions)
    if other_build:
        versions['python'] = '3.99'
    monkeypatch.setattr('mlmem_ros.session.replay.collect_versions', lambda: versions)
    status, output = replayed(capsys, SESSION)
    assert status == 0
    assert ('build' in output, '~/outcome' in output) == (other_build, not other_build)


def test_replay_json_holds_the_report(capsys, same_build):
    status, output = replayed(capsys, SESSION, '--json')
    report = json.loads(output)
    assert (status, report['code'], report['verdict']) == (0, 'exact', 'exact: the same bits')
    numbers = {'echo': 9, 'range': 9, 'outcome': 4, 'level': 4, 'content': 4}
    assert {name: found['equal'] for name, found in report['events'].items()} == numbers
    assert {name: found['recorded'] for name, found in report['events'].items()} == numbers
    assert report['events']['echo']['difference'] == 0.0
    assert (report['states']['recorded'], report['states']['equal']) == (19, 19)
    assert report['procedures']['replayed'] == ['write failed', 'abort', 'write 3', 'read 3']


@pytest.mark.parametrize('repaired', [False, True])
def test_truncated_bag_is_not_whole(tmp_path, capsys, replay_session, repaired):
    bag = Path(shutil.copytree(SESSION, tmp_path / 'cut'))
    (file,) = bag.glob('*.mcap')
    file.write_bytes(file.read_bytes()[: file.stat().st_size * 2 // 3])
    if repaired:
        (bag / 'metadata.yaml').unlink()
        bag = tmp_path / 'repaired'
        assert main(['inspect', str(tmp_path / 'cut'), '--repair', str(bag)]) == 0
    status, told = replayed(capsys, bag)
    assert status == 1
    assert 'bytes lost' in told
    assert 'NOT WHOLE: part of the recording is lost; in what remains, exact' in told
    counted = re.search(r'messages that metadata.yaml counts: .*~/outcome [123] of 4', told)
    assert bool(counted) != repaired
    with pytest.raises(AssertionError, match='NOT WHOLE'):
        replay_session(bag).assert_agrees()


@pytest.fixture(scope='module')
def split(tmp_path_factory, session):
    """The session in parts of some kilobytes, each beginning with the header."""
    path = tmp_path_factory.mktemp('split') / 'bag'
    with BagWriter(path, max_bytes=20_000) as writer:
        for name, info in session.topics.items():
            writer.add_topic(name, info.type, info.offered_qos, latch=name == '/mlmem/session')
        for message in session.messages:
            writer.write(message.topic, message.cdr, message.log_time)
            writer.sync()
    assert len(list(path.glob('*.mcap'))) > 3
    return path


@pytest.mark.parametrize(('place', 'listed'), [(None, True), (0, True), (2, False), (-1, True)])
def test_replay_of_a_split_session_ends_before_a_missing_part(
    split, tmp_path, capsys, place, listed
):
    """Whether metadata.yaml lists the part or is missing, too; a first part has the header."""
    bag = shutil.copytree(split, tmp_path / 'bag')
    parts = sorted(range(len(list(split.glob('*.mcap')))))
    if place is not None:
        (bag / f'bag_{parts[place]}.mcap').unlink()
    if not listed:
        (bag / 'metadata.yaml').unlink()
    status = main(['replay', str(bag), '--json'])
    report = json.loads(capsys.readouterr().out)
    if place == 0:
        assert (status, report['code']) == (2, 'begins_in_the_middle')
        return
    missing = [] if place is None else [parts[place] + 1]
    assert report['missing_parts'] == missing
    assert (status, report['code'] == 'part_missing') == (bool(missing), bool(missing))
    assert report['passed']
    assert 0 < report['states']['equal'] == report['states']['recorded']
    assert (report['states']['equal'] < 19) == bool(missing)
    if missing:
        assert replayed(capsys, bag, '--incomplete')[0] == 0


def test_dropped_messages_are_missing(session, tmp_path, capsys):
    """The recorder counts them on a topic of its own."""
    kind, topic = 'std_msgs/msg/UInt64', '/mlmem/session/dropped'
    made = session.copy()
    cdr = jazzy.serialize_message(jazzy.make_message(kind, data=7))
    made.messages.append(made.messages[-1]._replace(topic=topic, type=kind, cdr=cdr))
    made.topics[topic] = TopicInfo(topic, kind)
    made.definitions[topic] = jazzy.find_definition(kind)
    made.write(tmp_path / 'bag')
    status, told = replayed(capsys, tmp_path / 'bag')
    assert status == 1
    assert '7 messages were dropped from the recording' in told


def test_bag_with_nothing_to_compare_does_not_pass(tmp_path, capsys):
    status, told = replayed(capsys, foreign_bag(tmp_path / 'bag', WRITE_LEVEL_1_THEN_PROBE))
    assert status == 1
    assert 'NOTHING TO COMPARE' in told
    assert 'none recorded; here write 1, read 1' in told


@pytest.mark.parametrize(('level', 'status'), [('1', 0), ('2', 1)])
def test_outcomes_in_another_recorders_bag_are_compared(tmp_path, capsys, level, status):
    pair, kind = (
        JAZZY.types['diagnostic_msgs/msg/KeyValue'],
        'diagnostic_msgs/msg/DiagnosticStatus',
    )
    values = [pair('procedure', 'write'), pair('level', level)]
    outcome = {'level': 0, 'name': 'mlmem', 'message': '', 'hardware_id': '', 'values': values}
    messages = [*WRITE_LEVEL_1_THEN_PROBE[:1], (1.0, 'outcome', kind, outcome)]
    found, told = replayed(capsys, foreign_bag(tmp_path / 'bag', messages))
    assert found == status
    if status:
        assert 'procedures  0 of 1 agree: write 1' in told
        assert 'number 1 was write 2, is write 1' in told
        assert 'THE LEVELS DIFFER' in told
    else:
        assert told.endswith('the levels agree\n')


def test_levels_that_were_not_recorded_are_taken_from_outcomes(session, tmp_path):
    made = session.copy()
    made.messages = [each for each in made.messages if each.topic != '/mlmem/level']
    made.write(tmp_path / 'bag')
    found = load_session(tmp_path / 'bag')
    assert [echo.content for echo in found.echoes] == [*6 * [None], 3, None, 3]
    assert run_replay(found).passed


def test_session_of_another_format_is_rejected(session, tmp_path, capsys):
    """Also if it has keys that this format does not have."""
    bag = with_header(session, tmp_path / 'bag', format=2, moves=[])
    assert main(['replay', str(bag), '--json']) == 2
    assert json.loads(capsys.readouterr().out)['code'] == 'other_format'


def test_edited_settings_are_not_another_build(tmp_path, capsys):
    """A wider pulse gives equal levels but other bits, on any build."""
    life = Tampered.read(SESSION.parent / 'life')
    changes = {'versions__numpy': '1.0', 'settings__probe__sigma': 9.0}
    status, told = replayed(capsys, with_header(life, tmp_path / 'bag', **changes))
    assert status == 1
    assert 'build       numpy was 1.0' in told
    assert 'THE BITS DIFFER by more than rounding' in told
    assert 'inf' not in told
    assert re.search(r'~/echo \d of 10, ~/range', told)


@pytest.fixture
def same_build(monkeypatch):
    """Let the golden sessions be of this very build."""
    monkeypatch.setattr('mlmem_ros.session.replay._find_other_build', lambda recorded: {})


def change_margin(made):
    def change(message):
        (margin,) = [pair for pair in message.values if pair.key == 'threshold_margin']
        margin.value = '9.9'

    edit(made, copies(made, 'outcome')[-1], change)


def change_rows(made):
    """Change one of the times, displacements and demodulated values of each of three echoes."""
    for row, index in enumerate(copies(made, 'echo')[:3]):

        def change(message, row=row):
            rows = message.data.reshape(3, -1).copy()
            rows[row, -1] += 1e-3
            message.data = rows.ravel()

        edit(made, index, change)


@pytest.mark.parametrize(
    ('change', 'topic', 'unequal'),
    [
        (change_margin, 'outcome', 1),
        (change_rows, 'echo', 3),
        (lambda made: made.messages.pop(copies(made, 'echo')[1]), 'echo', None),
        (lambda made: made.messages.append(made.messages[copies(made, 'echo')[1]]), 'echo', None),
    ],
    ids=['margin', 'rows', 'left out', 'doubled'],
)
def test_replay_of_edited_events_names_their_topic(
    session, tmp_path, same_build, change, topic, unequal
):
    made = session.copy()
    change(made)
    made.write(tmp_path / 'bag')
    report = run_replay(load_session(tmp_path / 'bag'))
    assert not report.passed
    assert f'~/{topic}' in report.other_events
    if unequal:
        assert (report.code, report.other_events) == ('events_differ', [f'~/{topic}'])
        assert report.events[topic].equal == report.events[topic].recorded - unequal


def test_difference_of_arrays_of_other_sizes_is_infinite():
    assert find_difference(np.zeros(3), np.zeros(4)) == math.inf
    assert find_difference(np.array([0.0, np.nan]), np.array([0.0, np.nan])) == 0.0


ROUNDED = {'difference': Difference(500, 1e-12), 'state_difference': 1e-12}


@pytest.mark.parametrize(
    ('values', 'code', 'code_of_another_build'),
    [
        ({'hashes': 0}, 'nothing_to_compare', 'nothing_to_compare'),
        ({}, 'exact', 'exact'),
        (ROUNDED, 'rounding_differs', 'agrees'),
        (ROUNDED | {'state_difference': 1e-3}, 'states_differ', 'states_differ'),
        ({'events': {'echo': ComparedEvents(1, 1, 0, 1e-12)}}, 'events_differ', 'agrees'),
        ({'events': {'echo': ComparedEvents(2, 1, 1)}}, 'events_differ', 'events_differ'),
        ({'refused': ['tick 3: busy']}, 'commands_rejected', 'commands_rejected'),
        ({'recorded_levels': [1], 'levels': [2]}, 'levels_differ', 'levels_differ'),
        ({'recorded_levels': [None], 'levels': [2]}, 'exact', 'exact'),
        ({'foreign': True, **ROUNDED}, 'agrees', 'agrees'),
        ({'refused': ['busy'], 'lost': ['a chunk']}, 'incomplete', 'incomplete'),
        ({'missing_parts': [1]}, 'part_missing', 'part_missing'),
    ],
)
def test_verdict_depends_on_what_differs(values, code, code_of_another_build):
    for build, expected in (({}, code), ({'numpy': ('1', '2')}, code_of_another_build)):
        report = ReplayReport(**{'hashes': 2, **values}, other_build=build)
        assert report.code == expected
        assert report.passed == (expected in ('exact', 'agrees', 'part_missing'))
        assert report.exact or expected not in ('exact', 'part_missing')
