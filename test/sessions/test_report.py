# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A replay reports what it compared and what was missing; only a pass has exit status 0."""

import json
import re
import shutil
from pathlib import Path

import pytest

from mlmem_ros.bag import jazzy
from mlmem_ros.bag.writer import BagWriter
from mlmem_ros.session.data import load_session
from mlmem_ros.session.replay import ReplayReport, run_replay
from mlmem_ros.session.report import Difference
from mlmem_tools.cli.main import main

from .tampering import Tampered, string
from .test_replay import JAZZY, WRITE_LEVEL_1_THEN_PROBE, foreign_bag

pytest_plugins = ['mlmem_ros.testing']

ROOT = Path(__file__).parent.parent.parent
SESSION = ROOT / 'test' / 'data' / 'aborted_write'


@pytest.fixture(scope='module')
def session():
    return Tampered.read(SESSION)


def with_header(session, path, **values):
    """Write a session with changes to its header, such as `settings__probe__sigma=9.0`."""
    made = session.copy()
    for index, message in enumerate(made.messages):
        if message.topic == '/mlmem/session':
            header = json.loads(jazzy.deserialize_message(message.cdr, message.type).data)
            for names, value in values.items():
                *groups, name = names.split('__')
                group = header
                for each in groups:
                    group = group[each]
                group[name] = value
            made.messages[index] = message._replace(cdr=string(json.dumps(header)))
    made.write(path)
    return path


def replayed(capsys, *arguments):
    """Return the exit status of `mlmem replay` and its output, less the progress."""
    capsys.readouterr()
    status = main(['replay', *map(str, arguments)])
    told = capsys.readouterr()
    return status, told.out if status < 2 else told.err


def test_replay_says_what_it_compared(capsys, monkeypatch):
    """Texts of outcomes too, unless another build may word or round them otherwise."""
    made = load_session(SESSION).header.versions
    monkeypatch.setattr(
        'mlmem_ros.session.replay.collect_versions', lambda: {**made, 'python': '3.99'}
    )
    status, told = replayed(capsys, SESSION)
    assert status == 0
    assert 'build' in told
    assert '~/outcome' not in told
    monkeypatch.setattr('mlmem_ros.session.replay.collect_versions', lambda: made)
    status, told = replayed(capsys, SESSION)
    assert status == 0
    assert re.sub(' +', ' ', told).splitlines() == [
        'replayed 9180 ticks, 4 commands',
        'states 19 of 19 equal',
        'events ~/echo 9 of 9, ~/range 9 of 9, ~/outcome 4 of 4, ~/level 4 of 4, '
        '~/content 4 of 4 equal',
        'levels 2 of 2 agree: 3, 3',
        'procedures 4 of 4 agree: write failed, abort, write 3, read 3',
        'exact: the same bits',
    ]


def test_replay_json_holds_the_report(capsys):
    status, told = replayed(capsys, SESSION, '--json')
    report = json.loads(told)
    assert status == 0
    assert (report['code'], report['verdict']) == ('exact', 'exact: the same bits')
    assert report['events']['echo'] == {
        'recorded': 9,
        'compared': 9,
        'equal': 9,
        'difference': 0.0,
    }
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


def test_replay_of_a_split_session_is_exact(split, capsys):
    assert replayed(capsys, split)[0] == 0


@pytest.mark.parametrize(
    ('place', 'listed'), [(0, True), (0, False), (2, True), (2, False), (-1, True)]
)
def test_replay_without_a_part_ends_before_it(split, tmp_path, capsys, place, listed):
    """Whether metadata.yaml lists the part or is missing, too; a first part has the header."""
    bag = shutil.copytree(split, tmp_path / 'bag')
    part = place % len(list(split.glob('*.mcap')))
    (bag / f'bag_{part}.mcap').unlink()
    if not listed:
        (bag / 'metadata.yaml').unlink()
    status = main(['replay', str(bag), '--json'])
    report = json.loads(capsys.readouterr().out)
    if part == 0:
        assert (status, report['code']) == (2, 'begins_in_the_middle')
        return
    assert (status, report['code'], report['missing_parts']) == (1, 'part_missing', [part + 1])
    assert report['passed']
    assert 0 < report['states']['equal'] == report['states']['recorded'] < 19
    assert replayed(capsys, bag, '--incomplete')[0] == 0


def test_dropped_messages_are_missing(session, tmp_path, capsys):
    """The recorder counts them on a topic of its own."""
    made = Tampered.read(SESSION)
    kind, topic = 'std_msgs/msg/UInt64', '/mlmem/session/dropped'
    last = made.messages[-1]
    cdr = jazzy.serialize_message(jazzy.make_message(kind, data=7))
    made.messages.append(last._replace(topic=topic, type=kind, cdr=cdr))
    made.topics[topic] = type(next(iter(made.topics.values())))(topic, kind)
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


@pytest.mark.parametrize(
    ('missing', 'levels', 'words'),
    [
        (['level'], [*6 * [None], 3, None, 3], 'procedures  4 of 4 agree'),
        (
            ['level', 'outcome'],
            9 * [None],
            'levels      none recorded; here -1, -2, -2, 2, 2, 3, 3, 3, 3',
        ),
    ],
)
def test_levels_are_taken_from_what_was_recorded(
    session, tmp_path, capsys, missing, levels, words
):
    """Outcomes give levels, too; levels that were not recorded are not compared."""
    made = session.copy()
    made.messages = [m for m in made.messages if m.topic.rpartition('/')[2] not in missing]
    made.write(tmp_path / 'bag')
    assert [echo.content for echo in load_session(tmp_path / 'bag').echoes] == levels
    status, told = replayed(capsys, tmp_path / 'bag')
    assert status == 0
    assert words in told
    assert main(['inspect', str(tmp_path / 'bag')]) == 0
    assert 'no level' in capsys.readouterr().out


def test_session_with_too_many_messages_is_rejected(capsys, monkeypatch):
    monkeypatch.setattr('mlmem_ros.session.data.MAX_SESSION_BYTES', 100_000)
    assert main(['replay', str(SESSION), '--json']) == 2
    assert json.loads(capsys.readouterr().out)['code'] == 'too_large'


def test_session_of_another_format_is_rejected(session, tmp_path, capsys):
    """Also if it has keys that this format does not have."""
    bag = with_header(session, tmp_path / 'bag', format=2, moves=[])
    assert main(['replay', str(bag), '--json']) == 2
    told = capsys.readouterr()
    assert json.loads(told.out)['code'] == 'other_format'
    assert 'format must be 1; got 2' in told.err


@pytest.mark.parametrize('edited', ['settings__probe__sigma', 'settings__write__compression'])
def test_edited_settings_are_not_another_build(tmp_path, capsys, edited):
    """A wider pulse or a weaker cycle gives equal levels but other bits, on any build."""
    value = {'settings__probe__sigma': 9.0, 'settings__write__compression': -0.0345}[edited]
    life = Tampered.read(SESSION.parent / 'life')
    bag = with_header(life, tmp_path / 'bag', versions__numpy='1.0', **{edited: value})
    status, told = replayed(capsys, bag)
    assert status == 1
    assert 'build       numpy was 1.0' in told
    assert 'THE BITS DIFFER by more than rounding' in told
    assert 'inf' not in told
    assert re.search(r'~/echo \d of 10, ~/range', told)


def _margin(message):
    (margin,) = [pair for pair in message.values if pair.key == 'threshold_margin']
    margin.value = '9.9'


@pytest.fixture
def same_build(monkeypatch):
    """Let the golden sessions be of this very build."""
    monkeypatch.setattr('mlmem_ros.session.replay._find_other_build', lambda recorded: {})


def copies(made, topic):
    """Return the places of a topic's messages."""
    return [n for n, each in enumerate(made.messages) if each.topic == f'/mlmem/{topic}']


def edit(made, index, change):
    """Change a message of a session."""
    message = jazzy.deserialize_message(made.messages[index].cdr, made.messages[index].type)
    change(message)
    made.messages[index] = made.messages[index]._replace(cdr=jazzy.serialize_message(message))


def test_replay_of_an_edited_outcome_names_its_topic(session, tmp_path, same_build):
    made = session.copy()
    edit(made, copies(made, 'outcome')[-1], _margin)
    made.write(tmp_path / 'bag')
    report = run_replay(load_session(tmp_path / 'bag'))
    assert not report.passed
    assert (report.code, report.other_events) == ('events_differ', ['~/outcome'])
    outcomes = report.events['outcome']
    assert outcomes.equal == outcomes.recorded - 1


@pytest.mark.parametrize('copied', [0, 2], ids=['left out', 'doubled'])
def test_replay_of_another_number_of_echoes_fails(session, tmp_path, copied, same_build):
    made = session.copy()
    place = copies(made, 'echo')[1]
    made.messages[place : place + 1] = copied * [made.messages[place]]
    made.write(tmp_path / 'bag')
    report = run_replay(load_session(tmp_path / 'bag'))
    assert not report.passed
    assert '~/echo' in report.other_events


def test_replay_without_part_of_its_commands_is_incomplete(session, tmp_path):
    """What is lost may be a command, so that design and settings are not doubted."""
    made = session.copy()
    del made.messages[copies(made, 'session/command')[1]]
    made.write(tmp_path / 'bag')
    known = load_session(tmp_path / 'bag')
    known.lost = ['a chunk']
    report = run_replay(known)
    assert not report.passed
    assert report.code == 'incomplete'


def test_every_row_of_an_echo_is_compared(session, tmp_path, same_build):
    """Times, displacements and the demodulated signal: one of each of three echoes is changed."""
    made = session.copy()
    for row, index in enumerate(copies(made, 'echo')[:3]):

        def change(message, row=row):
            rows = message.data.reshape(3, -1).copy()
            rows[row, -1] += 1e-3
            message.data = rows.ravel()

        edit(made, index, change)
    made.write(tmp_path / 'bag')
    report = run_replay(load_session(tmp_path / 'bag'))
    assert report.events['echo'].equal == report.events['echo'].recorded - 3
    assert not report.passed


def test_another_build_may_round(session, tmp_path, capsys):
    report = ReplayReport(hashes=2, equal_hashes=1, difference=Difference(500, 1e-12))
    report.state_difference = 1e-12
    assert not report.passed
    assert report.verdict.startswith('THE BITS DIFFER;')
    report.other_build = {'arithmetic': ('unknown', 'fused 1')}
    assert report.passed
    assert not report.exact
    assert 'but for rounding' in report.verdict


def test_rejected_command_does_not_pass():
    report = ReplayReport(hashes=2, equal_hashes=2, refused=['tick 3: busy'])
    assert not report.passed
    assert 'commands that took effect are refused' in report.verdict
