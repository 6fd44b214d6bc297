# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A register holds words: small integers in every request, answer, topic and page."""

import json

import pytest
from nodes import QUICK
from robot import Robot, values

from mlmem_ros import RequestRefused
from mlmem_ros.session.data import load_session
from mlmem_ros.session.replay import run_replay
from mlmem_ros.testing import memory_node
from mlmem_tools.cli.main import main
from mlmem_tools.view import session_frame
from mlmem_tools.view.requests import Activity, PageRequests

WORD, OTHER = 0b100101, 0b1000
GIVEN = QUICK | {'element': 'byte'}


@pytest.fixture(scope='module')
def node(tmp_path_factory):
    root = tmp_path_factory.mktemp('root')
    with memory_node(GIVEN | {'files.root': str(root)}, name='words') as found:
        found.root = root
        yield found


@pytest.fixture
def memory(node):
    """A client of a node that holds `WORD`."""
    node.memory.write(WORD).wait()
    return node.memory


def trigger(node, service):
    """Return the answer of a service without fields."""
    with Robot(node.element) as robot:
        return json.loads(robot.response(robot.send(service)).message)


def test_client_reads_the_word_it_wrote(memory):
    read = memory.read().wait()
    assert (read.level, read.word, read.content, int(read.code, 2)) == (None, WORD, WORD, WORD)
    assert read.details['word'] == WORD
    assert 'level' not in read.details


@pytest.mark.parametrize('name', ['level', 'word'])
def test_request_may_name_the_content_either_way(memory, name):
    assert memory.request('write', **{name: OTHER}).wait().details['word'] == OTHER


def test_word_out_of_range_changes_nothing(memory):
    with pytest.raises(RequestRefused, match='word must be a whole number from 0 to 255; got 256'):
        memory.request('write', word=256).wait()
    assert memory.read().wait().word == WORD


def test_service_takes_the_word_from_target_word(node, memory):
    memory.set_parameters({'target_word': OTHER}).wait()
    answer = trigger(node, 'write')
    assert (answer['word'], answer['asked']) == (OTHER, OTHER)
    for name, value, why in (
        ('target_word', 256, 'target_word'),
        ('target_word', '0x7', 'target_word'),
        ('target_level', 5, 'target_level must be -1 .* takes target_word; got 5'),
    ):
        with pytest.raises(RequestRefused, match=why):
            memory.set_parameters({name: value}).wait()
    memory.set_parameters({'target_word': -1}).wait()
    assert 'write must be given' in trigger(node, 'write')['error']


def test_topics_speak_of_a_word(node):
    with Robot(node.element) as robot:
        node.memory.write(OTHER).wait()
        status = robot.latest('content', lambda status: values(status).get('word') == str(OTHER))
        assert status.message == f'word {OTHER} ({OTHER:#x})'
        outcome = robot.latest('outcome', lambda status: values(status).get('word') == str(OTHER))
        assert 'level' not in {**values(status), **values(outcome)}
        robot.latest('word', lambda message: message.data == OTHER)
        assert robot.node.count_publishers(f'{node.element}/level') == 0


def test_commands_take_hexadecimal_and_print_the_word(node, capsys):
    assert main(['write', f'{WORD:#x}', '--node', node.element]) == 0
    assert capsys.readouterr().out.startswith(f'wrote word {WORD} ({WORD:#x}) (code {WORD:08b}), ')
    assert main(['read', '--json', '--node', node.element]) == 0
    assert json.loads(capsys.readouterr().out)['word'] == WORD


def test_session_of_a_register_is_replayed_and_shown(node, memory, capsys):
    path = str(node.root / 'session')
    memory.record(True, path).wait()
    memory.write(OTHER).wait()
    memory.read().wait()
    memory.record(False).wait()
    report = run_replay(load_session(path))
    assert report.exact
    assert report.recorded_endings == [f'write {OTHER}', f'read {OTHER}']
    assert report.recorded_levels == report.levels == [OTHER, OTHER]
    assert main(['inspect', path]) == 0
    listed = capsys.readouterr().out
    assert f'{OTHER:08b}' in listed
    assert f'Write(word {OTHER} ({OTHER:#x}))' in listed
    assert main(['inspect', path, '--json']) == 0
    found = json.loads(capsys.readouterr().out)
    assert [each['word'] for each in found['echoes']] == [OTHER, OTHER]
    assert [each['word'] for each in found['procedures']] == [str(OTHER), str(OTHER)]
    frame = session_frame.load_frame(path).frame
    head = json.loads(frame[4 : 4 + int.from_bytes(frame[:4], 'little')])
    assert head['element']['code']['tops'][3] == 8
    assert head['levels'][-1][1] == OTHER


def test_page_writes_a_word(memory):
    requests = PageRequests(memory, Activity())
    assert requests.send({'do': 'write', 'word': OTHER}).wait().word == OTHER
    with pytest.raises(ValueError, match='level must be a whole number'):
        requests.send({'do': 'write', 'word': '0x7'})


def test_session_page_writes_a_word_as_word():
    event = {'t': 0.0, 'kind': 'outcome', 'text': 'write succeeded'}
    event['values'] = {'word': str(OTHER)}
    assert (
        session_frame._shorten_event(event)['text']
        == f'write succeeded, word {OTHER} ({OTHER:#x})'
    )
