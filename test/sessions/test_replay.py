# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which bags hold a session, and what a replay reports; only a pass has exit status 0."""

from __future__ import annotations

import json
import math
import re
import shutil
from dataclasses import dataclass
from functools import reduce
from operator import getitem
from pathlib import Path

import pytest
from rosbags.rosbag2 import Reader, StoragePlugin, Writer

from mlmem_ros.bag import jazzy
from mlmem_ros.bag.contents import Message, TopicInfo
from mlmem_ros.bag.errors import BagError
from mlmem_ros.bag.reader import BagReader
from mlmem_ros.bag.writer import BagWriter
from mlmem_ros.session.data import load_session
from mlmem_ros.session.records import build_header
from mlmem_ros.session.replay import ReplayReport, build_element, find_difference, run_replay
from mlmem_ros.session.report import Comparison
from mlmem_ros.testing import assert_replays
from mlmem_tools.cli.main import main

DATA = Path(__file__).parent.parent / 'data'
"""Golden sessions, recorded by a node in real time and run again without ROS:

    life            write 2, read, erase, come to rest, read
    manual_drive    write 0, then one level on by strain set by hand, read
    aborted_write   write 3, abort on the way, write 1, read

They were recorded with numpy 2.4 and numba 0.68 on a processor with AVX-512; a build that gives
other bits must still decode the same levels.
"""


@dataclass
class Tampered:
    """A recorded session that a test changes before it is written again; its file stays whole."""

    topics: dict[str, TopicInfo]
    messages: list[Message]

    @classmethod
    def read(cls, path: Path) -> Tampered:
        """Return a session as it is, less the topics on which nothing was said."""
        reader = BagReader(path)
        topics = {name: info for name, info in reader.topics.items() if info.message_count}
        return cls(topics, list(reader))

    def write(self, path: Path) -> None:
        """Write it, whatever it holds, as a whole bag."""
        with BagWriter(path) as writer:
            for name, info in self.topics.items():
                writer.add_topic(name, info.type)
            for message in self.messages:
                writer.write(message.topic, message.cdr, message.log_time)


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


# --- what a replay reports ------------------------------------------------------------------

SESSION = DATA / 'aborted_write'
HEADER = '/mlmem/session'
HASHES = 4
"""State hashes of that session."""


def find_places(made, topic):
    """Return the places of a topic's messages."""
    return [n for n, each in enumerate(made.messages) if each.topic == f'/mlmem/{topic}']


def edit(made, index, change):
    """Change a message of a session."""
    recorded = made.messages[index]
    message = jazzy.deserialize_message(recorded.cdr, recorded.type)
    change(message)
    cdr = jazzy.encode_message(recorded.type, **vars(message))
    made.messages[index] = recorded._replace(cdr=cdr)


def with_header(made, path, **values):
    """Write a session with changes to its header, such as `settings__probe__sigma=9.0`."""

    def change(message):
        header = json.loads(message.data)
        for names, value in values.items():
            *groups, name = names.split('__')
            reduce(getitem, groups, header)[name] = value
        message.data = json.dumps(header)

    edit(made, *find_places(made, 'session'), change)
    made.write(path)
    return path


def replayed(capsys, *arguments):
    """Return the exit status of `mlmem replay` and its output, less the progress."""
    capsys.readouterr()
    status = main(['replay', *map(str, arguments)])
    told = capsys.readouterr()
    return status, told.out if status < 2 else told.err


def test_replay_json_holds_the_report(capsys, same_build):
    status, output = replayed(capsys, SESSION, '--json')
    report = json.loads(output)
    assert (status, report['code'], report['verdict']) == (0, 'exact', 'exact: the same bits')
    numbers = {'echo': 9, 'range': 9, 'outcome': 4, 'level': 4, 'content': 4}
    assert {name: found['equal'] for name, found in report['events'].items()} == numbers
    assert {name: found['recorded'] for name, found in report['events'].items()} == numbers
    assert report['events']['echo']['difference'] == 0.0
    assert (report['states']['recorded'], report['states']['equal']) == (HASHES, HASHES)
    assert report['procedures']['replayed'] == ['write failed', 'abort', 'write 3', 'read 3']


@pytest.mark.parametrize('counted', [False, True])
def test_truncated_bag_is_not_whole(tmp_path, capsys, counted):
    """It is read without its metadata, too, which count what was synced."""
    bag = Path(shutil.copytree(SESSION, tmp_path / 'cut'))
    (file,) = bag.glob('*.mcap')
    file.write_bytes(file.read_bytes()[: file.stat().st_size * 2 // 3])
    if not counted:
        (bag / 'metadata.yaml').unlink()
    assert main(['inspect', str(bag)]) == 1
    status, told = replayed(capsys, bag)
    assert status == 1
    assert 'bytes lost' in told
    assert 'NOT WHOLE: part of the recording is lost; in what remains, exact' in told
    found = re.search(r'messages that metadata.yaml counts: .*~/outcome [123] of 4', told)
    assert bool(found) == counted
    with pytest.raises(AssertionError, match='NOT WHOLE'):
        assert_replays(bag)


def test_topic_that_only_the_metadata_knows_is_lost(tmp_path, capsys):
    bag = Path(shutil.copytree(SESSION, tmp_path / 'edited'))
    metadata = bag / 'metadata.yaml'
    metadata.write_text(metadata.read_text().replace('name: /mlmem/outcome', 'name: /mlmem/other'))
    status, told = replayed(capsys, bag)
    assert (status, 'messages that metadata.yaml counts: ~/other 4 of 4' in told) == (1, True)


@pytest.fixture(scope='module')
def split(tmp_path_factory):
    """The session in parts of some kilobytes, each beginning with a state of the idle device; the
    last is a read.
    """
    path = tmp_path_factory.mktemp('split') / 'bag'
    session, loaded = Tampered.read(SESSION), load_session(SESSION)
    element, commands = build_element(loaded), dict(loaded.stamped)
    with BagWriter(path, max_bytes=20_000) as writer:
        for name, info in session.topics.items():
            writer.add_topic(name, info.type, begins_file=name == HEADER)
        for message in session.messages:
            if message.topic.startswith(f'{HEADER}/'):
                record = jazzy.deserialize_message(message.cdr, message.type)
                tick = json.loads(record.data)['tick']
                while element.ticks < tick:
                    if command := commands.get(element.ticks):
                        element.apply(command)
                    element.advance()
                if not element.procedure:
                    writer.sync()  # so that it knows how full the file is
                    writer.write(HEADER, build_header(element, '/mlmem', {}), message.log_time)
            writer.write(message.topic, message.cdr, message.log_time)
    assert len(list(path.glob('*.mcap'))) > 3
    return path


def test_rewritten_part_is_exact(split, tmp_path, same_build):
    """Another tool leaves out the number of the part."""
    Tampered.read(split / 'bag_2.mcap').write(tmp_path / 'bag')
    report = run_replay(load_session(tmp_path / 'bag'))
    assert (report.code, report.whole) == ('exact', True)


@pytest.mark.parametrize('numbered', [False, True])
def test_part_with_an_older_state_begins_in_the_middle(
    split, tmp_path, capsys, same_build, numbered
):
    """As a tool that repeats the first message of a latched topic in every file makes it."""
    part = Tampered.read(max(split.glob('*.mcap')))
    part.messages[0] = Tampered.read(split).messages[0]
    part.write(tmp_path / 'bag')
    session = load_session(tmp_path / 'bag')
    if numbered:
        session.missing_parts, session.lost = (0, 1), ['part 1 of 3 is missing']
    report = run_replay(session)
    assert (report.code, report.passed) == ('begins_in_the_middle', False)
    assert replayed(capsys, tmp_path / 'bag')[0] == 1


def test_part_with_a_newer_state_begins_in_the_middle(split, tmp_path, capsys):
    """As a cut through a part leaves its end and the next part."""
    made = Tampered.read(split)
    del made.messages[: find_places(made, 'session/command')[-1]]
    made.write(tmp_path / 'bag')
    assert main(['replay', str(tmp_path / 'bag'), '--json']) == 2
    assert json.loads(capsys.readouterr().out)['code'] == 'begins_in_the_middle'


@pytest.mark.parametrize(
    ('place', 'listed'), [(0, True), (0, False), (2, True), (2, False), (-1, True)]
)
def test_replay_without_a_part_names_it(split, tmp_path, capsys, place, listed):
    """Whether metadata.yaml lists the part or is missing, too."""
    bag = shutil.copytree(split, tmp_path / 'bag')
    part = place % len(list(split.glob('*.mcap')))
    (bag / f'bag_{part}.mcap').unlink()
    if not listed:
        (bag / 'metadata.yaml').unlink()
    status = main(['replay', str(bag), '--json'])
    report = json.loads(capsys.readouterr().out)
    assert (status, report['code'], report['missing_parts']) == (1, 'part_missing', [part + 1])
    assert report['passed']
    where = 'up to there' if part else 'in what is replayed'
    assert f'part {part + 1} is missing; {where}, ' in report['verdict']
    assert 0 < report['states']['equal'] == report['states']['recorded'] < HASHES
    if part == 0:
        assert replayed(capsys, bag, '--incomplete')[0] == 0


def test_dropped_messages_are_missing(tmp_path, capsys):
    """The recorder counts them on a topic of its own."""
    made = Tampered.read(SESSION)
    kind, topic = 'std_msgs/msg/UInt64', '/mlmem/session/dropped'
    last = made.messages[-1]
    cdr = jazzy.encode_message(kind, data=7)
    made.messages.append(last._replace(topic=topic, type=kind, cdr=cdr))
    made.topics[topic] = type(next(iter(made.topics.values())))(topic, kind)
    made.write(tmp_path / 'bag')
    status, told = replayed(capsys, tmp_path / 'bag')
    assert status == 1
    assert '7 messages were dropped from the recording' in told


@pytest.mark.parametrize(
    ('missing', 'words'),
    [(['level'], 'procedures  4 of 4 agree'), (['level', 'outcome'], 'none recorded; here')],
)
def test_only_recorded_topics_are_compared(tmp_path, capsys, missing, words):
    made = Tampered.read(SESSION)
    made.messages = [m for m in made.messages if m.topic.rpartition('/')[2] not in missing]
    made.write(tmp_path / 'bag')
    status, output = replayed(capsys, tmp_path / 'bag')
    assert (status, words in output) == (0, True)


def test_bag_without_a_session_has_exit_status_2(capsys, tmp_path):
    assert main(['replay', str(tmp_path / 'nothing')]) == 2
    assert 'nothing' in capsys.readouterr().err


def test_session_of_another_format_is_rejected(tmp_path, capsys):
    """Also if it has keys that this format does not have."""
    bag = with_header(Tampered.read(SESSION), tmp_path / 'bag', format=2, moves=[])
    assert main(['replay', str(bag), '--json']) == 2
    assert json.loads(capsys.readouterr().out)['code'] == 'other_format'


@pytest.mark.parametrize('edited', ['settings__probe__sigma', 'settings__write__compression'])
def test_edited_settings_are_not_another_build(tmp_path, capsys, edited):
    """A wider pulse or a weaker cycle gives equal levels but other bits, on any build."""
    value = {'settings__probe__sigma': 9.0, 'settings__write__compression': -0.0345}[edited]
    life = Tampered.read(DATA / 'life')
    bag = with_header(life, tmp_path / 'bag', versions__numpy='1.0', **{edited: value})
    status, told = replayed(capsys, bag)
    assert status == 1
    assert 'build       numpy was 1.0' in told
    assert 'THE BITS DIFFER by more than rounding' in told
    assert 'inf' not in told
    assert re.search(r'~/echo \d of 10, ~/range', told)


@pytest.fixture
def same_build(monkeypatch):
    """Let the golden sessions be of this very build."""
    monkeypatch.setattr('mlmem_ros.session.replay._find_other_build', lambda recorded: {})


def test_replay_of_an_edited_session_names_every_topic(tmp_path, same_build):
    """The text of an outcome; of three echoes a time, a displacement and a demodulated value."""

    def change_margin(message):
        (margin,) = [pair for pair in message.values if pair.key == 'threshold_margin']
        margin.value = '9.9'

    made = Tampered.read(SESSION)
    edit(made, find_places(made, 'outcome')[-1], change_margin)
    for row, index in enumerate(find_places(made, 'echo')[:3]):

        def change_row(message, row=row):
            rows = message.data.reshape(3, -1).copy()
            rows[row, -1] += 1e-3
            message.data = rows.ravel()

        edit(made, index, change_row)
    made.write(tmp_path / 'bag')
    report = run_replay(load_session(tmp_path / 'bag'))
    assert not report.passed
    assert report.code == 'events_differ'
    assert sorted(report.other_events) == ['~/echo', '~/outcome']
    for topic, edited in (('echo', 3), ('outcome', 1)):
        assert report.events[topic].equal == report.events[topic].recorded - edited


def test_replay_of_another_number_of_messages_fails(tmp_path, same_build):
    """One is left out, and one of another topic is doubled."""
    made = Tampered.read(SESSION)
    del made.messages[find_places(made, 'echo')[1]]
    doubled = find_places(made, 'range')[1]
    made.messages.insert(doubled, made.messages[doubled])
    made.write(tmp_path / 'bag')
    report = run_replay(load_session(tmp_path / 'bag'))
    assert not report.passed
    assert sorted(report.other_events) == ['~/echo', '~/range']


EQUAL, ROUNDED, OTHER = Comparison(2, 2, 2), Comparison(2, 2, 1, 1e-12), Comparison(2, 2, 1, 1e-3)


@pytest.mark.parametrize(
    ('values', 'code', 'code_of_another_build'),
    [
        ({'states': Comparison()}, 'nothing_to_compare', 'nothing_to_compare'),
        ({}, 'exact', 'exact'),
        ({'states': ROUNDED}, 'rounding_differs', 'agrees'),
        ({'states': OTHER}, 'states_differ', 'states_differ'),
        ({'events': {'echo': Comparison(1, 1, 0, 1e-12)}}, 'events_differ', 'agrees'),
        ({'events': {'echo': Comparison(2, 1, 1)}}, 'events_differ', 'events_differ'),
        ({'refused': ['tick 3: busy']}, 'commands_rejected', 'commands_rejected'),
        ({'events': {'level': Comparison(2, 2, 1, 1.0)}}, 'levels_differ', 'levels_differ'),
        ({'recorded_endings': ['read 2']}, 'levels_differ', 'levels_differ'),
        ({'refused': ['busy'], 'lost': ['a chunk']}, 'incomplete', 'incomplete'),
        ({'missing_parts': [1]}, 'part_missing', 'part_missing'),
        ({'begins_late': True}, 'exact', 'exact'),
        (
            {'begins_late': True, 'refused': ['busy'], 'lost': ['a chunk']},
            *2 * ['begins_in_the_middle'],
        ),
    ],
)
def test_verdict_depends_on_what_differs(values, code, code_of_another_build):
    for build, expected in (({}, code), ({'numpy': ('1', '2')}, code_of_another_build)):
        report = ReplayReport(**{'states': EQUAL, **values}, other_build=build)
        assert report.code == expected
        assert report.passed == (expected in ('exact', 'agrees', 'part_missing'))
        assert report.exact or expected not in ('exact', 'part_missing')
