# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Words that no integer of a message holds: told as text on every way in and out."""

import json
from functools import partial

import pytest
from nodes import QUICK
from robot import Robot, values
from wide import BYTE, TOP, of, wide

from mlmem_ros import MemoryBank, RequestRefused
from mlmem_ros.device import Read, Write, new_element, snapshot
from mlmem_ros.physics import StateError
from mlmem_ros.procedures import WIDE
from mlmem_ros.session.data import load
from mlmem_ros.session.replay import replay
from mlmem_ros.testing import memory_node
from mlmem_tools.cli.main import main
from mlmem_tools.view import session_frame
from mlmem_tools.view.requests import Activity, Requests

WORD = of([0, 2, 5])
GIVEN = QUICK | {'design.preset': 'byte'}


@pytest.fixture(scope='module')
def node(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        wide(patch)
        root = tmp_path_factory.mktemp('root')
        with memory_node(GIVEN | {'files.root': str(root)}, name='wide') as found:
            found.root = root
            yield found


def test_a_client_writes_and_reads_them(node):
    assert TOP > 2**64
    assert node.memory.write(WORD).wait().level == WORD
    read = node.memory.read().wait()
    assert (read.level, read.word, int(read.code, 2)) == (WORD, f'{WORD:#x}', WORD)
    assert (read.details['level'], read.details['word']) == (WIDE, read.word)


def test_what_is_no_word_of_the_element_is_refused(node):
    for word in (2 * TOP, 2**1000):
        with pytest.raises(
            RequestRefused, match=f'level must be a whole number from 0 to {2 * TOP - 1}'
        ):
            node.memory.write(word).wait()
    with pytest.raises(RequestRefused, match='word must be a number such as 0xa7 or 167'):
        node.memory.request('write', word='a7').wait()
    with pytest.raises(RequestRefused, match='write must be given level'):
        node.memory.request('write').wait()


def test_a_service_takes_them_from_a_parameter_and_tells_them_as_text(node):
    """JavaScript keeps no integer above 2^53 - 1."""
    other = of([3])
    node.memory.set_parameters({'target_word': f'{other:#x}'}).wait()
    answer = json.loads(said(node, 'write'))
    assert (answer['level'], int(answer['word'], 16)) == (WIDE, other)
    assert (answer['asked'], answer['asked_word']) == (WIDE, f'{other:#x}')
    node.memory.set_parameters({'target_level': 0}).wait()  # the last one that is set counts
    assert node.memory.parameters('target_word').wait() == {'target_word': ''}
    assert json.loads(said(node, 'write'))['level'] == 0
    for bad, why in (
        ('a7', 'must be a number such as 0xa7'),
        (f'{2 * TOP:#x}', 'must be from 0x0'),
    ):
        with pytest.raises(RequestRefused, match=f'target_word {why}'):
            node.memory.set_parameters({'target_word': bad}).wait()


def said(node, service):
    """Return the answer of a service without fields."""
    with Robot(node.element) as robot:
        return robot.response(robot.send(service)).message


def test_topics_hold_what_fits_and_the_content_all_of_it(node):
    with Robot(node.element) as robot:
        for word, level in ((WORD, WIDE), (0, 0)):
            assert node.memory.write(word).wait().word == f'{word:#x}'
            for topic in ('content', 'outcome'):
                told = values(robot.latest(topic, partial(tells, level)))
                assert told['word'] == f'{word:#x}'
            robot.latest('level', lambda message, level=level: message.data == level)


def tells(level, status):
    """Return whether a status tells a level."""
    return values(status)['level'] == str(level)


def test_a_session_is_replayed_and_shown(node, capsys):
    memory, path = node.memory, str(node.root / 'session')
    memory.record(True, path).wait()
    memory.write(WORD).wait()
    memory.read().wait()
    memory.record(False).wait()
    session = load(path)
    report = replay(session)
    assert report.exact
    assert report.recorded_endings == [f'write {WORD:#x}', f'read {WORD:#x}']
    assert report.recorded_levels == report.levels == [WORD, WORD]
    assert main(['inspect', path]) == 0
    assert f'{WORD:#x}' in capsys.readouterr().out
    head = json.loads(frame(path))
    assert head['element']['code']['tops'][3] == '0x8'
    assert head['levels'][-1][1] == f'{WORD:#x}'


def frame(path):
    """Return what a page gets of a session, without the numbers after it."""
    found = session_frame.load(path).frame
    return found[4 : 4 + int.from_bytes(found[:4], 'little')]


def test_commands_take_hexadecimal_and_print_it(node, capsys):
    assert main(['write', f'{WORD:#x}', '--node', node.element]) == 0
    assert capsys.readouterr().out.startswith(f'level {WORD:#x}, ')
    assert main(['read', '--json', '--node', node.element]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert (answer['level'], answer['word']) == (WIDE, f'{WORD:#x}')


def test_a_page_asks_with_texts(node):
    activity = Activity()
    asked = {'do': 'write', 'word': f'{WORD:#x}'}
    assert Requests(node.memory, activity).send(asked).wait().level == WORD
    with pytest.raises(ValueError, match='word must be a number'):
        Requests(node.memory, activity).send({**asked, 'word': [7]})


def test_the_state_file_keeps_them(monkeypatch):
    wide(monkeypatch)
    element = new_element(BYTE)
    element.perform(Write(WORD))
    kept = json.loads(json.dumps(snapshot.take(element)))
    other = new_element(BYTE)
    snapshot.restore(other, kept)
    assert other.reading.level == WORD
    assert other.perform(Read()).reading.level == WORD
    kept['reading']['level'] = 2 * TOP
    with pytest.raises(StateError, match='level must be from -2'):
        snapshot.restore(new_element(BYTE), kept)


def test_elements_of_a_bank_are_digits(node):
    bank = MemoryBank([node.memory], base=2 * TOP)
    assert bank.write(WORD).wait().value == WORD
    assert bank.read().wait().digits == (WORD,)


@pytest.mark.slow
def test_the_longest_register_takes_words_of_64_bits():
    word = 0x1234567890ABCDEF
    given = GIVEN | {'design.preset': 'register_8', 'scale.time': 1e-6}
    with memory_node(given, name='long') as node:
        assert node.memory.write(word, timeout=600.0).wait().level == word
        read = node.memory.read(timeout=60.0).wait()
        assert (read.level, read.word) == (word, f'{word:#x}')
        with pytest.raises(RequestRefused, match='level must be a whole number from 0 to'):
            node.memory.write(2**65).wait()
