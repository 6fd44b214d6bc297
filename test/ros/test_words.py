# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A register holds words: small integers in every request, answer, topic and page."""

import json

import pytest
from robot import values

from mlmem_ros import MemoryClient, RequestRefused
from mlmem_ros.contract.requests import load_action_types
from mlmem_ros.session.data import load_session
from mlmem_ros.session.replay import run_replay
from mlmem_tools.cli.main import main
from mlmem_tools.view import session_frame

WORD, OTHER = 0b100101, 0b1000

GIVEN = {'element': 'byte', 'actions': True}


def test_client_reads_the_word_it_wrote(client):
    plain = MemoryClient(client.node, client.name, actions=False)
    for writing in (
        client.request('write', word=OTHER),
        client.request('write', content=OTHER),
        client.procedure('write', word=OTHER),
        plain.write(OTHER),
    ):
        details = writing.wait().details
        assert (details['word'], details['asked']) == (OTHER, OTHER)
    client.write(WORD).wait()
    read = client.read().wait()
    assert (read.level, read.word, read.content, int(read.code, 2)) == (None, WORD, WORD, WORD)
    assert read.details['word'] == WORD
    assert 'level' not in read.details


def test_level_is_rejected_by_a_register(robot, client, memory):
    """By request, by topic and as a goal; each rejection is counted."""
    client.write(WORD).wait()
    counted, seen = robot.count_refused(), len(memory.output)
    wrong = ({'level': OTHER}, {'level': OTHER, 'word': OTHER})
    for given in wrong:
        with pytest.raises(RequestRefused) as refused:
            client.request('write', **given).wait()
        answer = refused.value.answer
        assert (answer['error_code'], answer['field']) == ('unsupported', 'level')
    robot.publish('write_level', data=OTHER)
    robot.wait(lambda: '/write_level refused' in memory.output[seen:], 'the rejection')
    if load_action_types():
        for given in wrong:
            result = robot.action('write').do(**given).result
            assert result.error_code == result.REFUSED
            assert result.error.startswith('level must be')
            counted += 1
    assert robot.count_refused() == counted + 3
    assert client.read().wait().word == WORD


def test_service_takes_the_word_from_target_word(robot, client):
    client.set_parameters({'target_word': OTHER}).wait()
    answer = robot.trigger('write')
    assert (answer['word'], answer['asked']) == (OTHER, OTHER)
    for name, value in (('target_word', 256), ('target_word', '0x7'), ('target_level', 5)):
        with pytest.raises(RequestRefused, match=name):
            client.set_parameters({name: value}).wait()
    client.set_parameters({'target_word': -1}).wait()
    assert 'must be given: write takes' in robot.trigger('write')['error']
    with pytest.raises(RequestRefused, match='word'):
        client.request('write', word=256).wait()
    assert client.read().wait().word == OTHER


def test_topics_speak_of_a_word(robot, client):
    client.write(WORD).wait()
    client.write(OTHER).wait()
    status = robot.latest('content', lambda status: values(status).get('word') == str(OTHER))
    assert status.message == f'word {OTHER} ({OTHER:#x})'
    outcome = robot.latest('outcome', lambda status: values(status).get('word') == str(OTHER))
    assert 'level' not in {**values(status), **values(outcome)}
    robot.latest('word', lambda message: message.data == OTHER)
    assert robot.node.count_publishers(robot.name('level')) == 0


def test_commands_take_hexadecimal_and_print_the_word(memory, capsys):
    assert main(['write', f'{WORD:#x}', '--node', memory.element]) == 0
    assert capsys.readouterr().out.startswith(f'wrote word {WORD} ({WORD:#x}) (code {WORD:08b}), ')
    assert main(['read', '--json', '--node', memory.element]) == 0
    assert json.loads(capsys.readouterr().out)['word'] == WORD


def test_session_of_a_register_is_replayed_and_shown(client, tmp_path, capsys):
    path = str(tmp_path / 'session')
    client.record(True, path).wait()
    client.write(OTHER).wait()
    client.read().wait()
    client.record(False).wait()
    report = run_replay(load_session(path))
    assert report.exact
    assert report.recorded_endings == [f'write {OTHER}', f'read {OTHER}']
    assert main(['inspect', path]) == 0
    listed = capsys.readouterr().out
    assert f'{OTHER:08b}' in listed
    assert f'write word {OTHER} ({OTHER:#x})' in listed
    assert main(['inspect', path, '--json']) == 0
    found = json.loads(capsys.readouterr().out)
    assert [each['word'] for each in found['procedures']] == [str(OTHER), str(OTHER)]
    frame = session_frame.load_frame(path)
    head = json.loads(frame[4 : 4 + int.from_bytes(frame[:4], 'little')])
    assert head['element']['code']['tops'][3] == 8
    assert head['levels'][-1][1] == OTHER
    assert any(f'word {OTHER} ({OTHER:#x})' in event['text'] for event in head['events'])
