# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Several elements as one word, over real DDS: three elements of eight levels, nine bits."""

import contextlib
import functools
import runpy
import sys
from pathlib import Path

import pytest
import rclpy
from nodes import QUICK
from rclpy.executors import SingleThreadedExecutor
from rclpy.task import Future
from robot import Robot
from std_msgs.msg import Int16

from mlmem_ros import (
    BankFailed,
    LostWord,
    MemoryBank,
    MemoryClient,
    RequestRefused,
    TornWord,
    standalone,
)
from mlmem_ros.contract.services import action_types
from mlmem_ros.ros.client.client import wait_until
from mlmem_ros.ros.main import bank_arguments
from mlmem_ros.ros.middleware import LATCHED
from mlmem_ros.ros.node import simulator
from mlmem_ros.ros.node_process import node_arguments
from mlmem_ros.testing.running import NodeHere

ELEMENTS = 3
GIVEN = QUICK | {'write.attempts': 1}


@pytest.fixture(scope='module')
def bank():
    """What bank.launch.py starts, of small elements."""
    arguments, elements = bank_arguments(
        ['memory_bank', f'--elements={ELEMENTS}', *node_arguments('mlmem', GIVEN)]
    )
    with (
        NodeHere('/bank/element_0/mlmem', arguments, elements),
        standalone() as client,
    ):
        bank = MemoryBank.on(client.node, ELEMENTS)
        bank.ready(60).wait()
        yield bank


@pytest.fixture
def holding(bank):
    """The bank, with a word in it."""
    bank.write(0o213).wait()
    return bank


def test_a_word_is_written_and_read(bank):
    written = bank.write(0o213).wait()
    assert (written.value, written.digits) == (0o213, (3, 1, 2))
    assert str(written) == '2 1 3'
    read = bank.read().wait()
    assert read.value == 0o213
    assert [said.code for said in read.answers] == ['011', '001', '010']


def test_a_bank_on_a_node_without_an_executor(holding):
    with on_a_node_of_its_own() as node:
        assert MemoryBank.on(node, ELEMENTS).read(end='both').wait().value == 0o213


def test_a_callback_awaits_a_bank(holding):
    with on_a_node_of_its_own() as node:
        mine, said = MemoryBank.on(node, ELEMENTS), Future()

        async def read():
            timer.cancel()
            said.set_result(await mine.read())

        timer = node.create_timer(0.001, read)
        executor = SingleThreadedExecutor(context=node.context)
        executor.add_node(node)
        executor.spin_until_future_complete(said, 30.0)
        assert said.result().value == 0o213


@contextlib.contextmanager
def on_a_node_of_its_own():
    context = rclpy.Context()
    rclpy.init(args=[], context=context)
    node = rclpy.create_node('behaviour', context=context, use_global_arguments=False)
    yield node
    node.destroy_node()
    rclpy.shutdown(context=context)


def test_every_element_holds_its_digit(bank):
    bank.write(0o012).wait()
    alone = MemoryClient(bank.elements[0].node, '/bank/element_1/mlmem')
    assert alone.read().wait().level == 1


def test_elements_are_written_at_the_same_time(bank):
    """While one is paused, the others are written."""
    held, *others = bank.elements
    heard = {}
    for other in others:
        keep = functools.partial(keep_level, heard, other.name)
        other.node.create_subscription(Int16, f'{other.name}/level', keep, LATCHED)
    held.pause().wait()
    try:
        writing = bank.write(0o211)
        written = {others[0].name: 1, others[1].name: 2}
        wait_until(lambda: heard == written, 'both levels', 30.0)
        assert not writing.done()
    finally:
        held.pause(False).wait()
    assert writing.wait().value == 0o211


def keep_level(heard, name, message):
    heard[name] = message.data


def test_an_erased_bank_holds_no_word(bank):
    erased = bank.erase().wait()
    assert (erased.blank, erased.value, erased.digits) == (True, None, (-1, -1, -1))
    assert str(bank.read().wait()) == '- - -'
    bank.elements[2].write(1).wait()
    half = bank.read().wait()
    assert (half.blank, half.value, str(half)) == (False, None, '1 - -')


def test_a_word_that_does_not_fit_is_not_sent(bank):
    assert (bank.size, bank.bits) == (512, 9)
    for word in (512, -1, 1.0, True, '7'):
        with pytest.raises(ValueError, match='word must be a whole number from 0 to 511'):
            bank.write(word)


def test_an_element_that_refuses_is_named_and_the_others_write(bank):
    bank.write(0).wait()
    busy = bank.elements[1]
    busy.pause().wait()
    reading = busy.read(timeout=30)
    try:
        busy.step().wait()  # begins the read: from now on it is busy
        writing = bank.write(0o111)
        wait_until(lambda: busy.step().wait() and writing.done(), 'the refusal', 30.0)
    finally:
        busy.pause(False).wait()
    with pytest.raises(BankFailed, match='1 of 3 elements failed: /bank/element_1/mlmem: busy'):
        writing.wait()
    reading.wait()
    assert bank.read().wait().digits == (1, 0, 1)


def test_a_missing_element_is_named(bank):
    nobody = MemoryClient(bank.elements[0].node, '/nobody', patience=0.2)
    with pytest.raises(BankFailed, match='/nobody: no memory node answers') as failure:
        MemoryBank([bank.elements[0], nobody]).read().wait()
    assert list(failure.value.errors) == ['/nobody']


def test_a_smaller_base_uses_fewer_levels(bank):
    bits = MemoryBank(bank.elements, base=2)
    assert bits.write(0b101).wait().digits == (1, 0, 1)
    bank.elements[0].write(2).wait()
    with pytest.raises(BankFailed, match='level 2 is not a digit of base 2'):
        bits.read().wait()


def test_a_level_that_the_elements_do_not_have(bank):
    greedy = MemoryBank(bank.elements, base=10)
    with pytest.raises(BankFailed, match='from 0 to 7; got 9') as failure:
        greedy.write(9).wait()
    (error,) = failure.value.errors.values()
    assert isinstance(error, RequestRefused)


def test_a_bank_has_elements_and_a_base(bank):
    with pytest.raises(ValueError, match='elements must be at least one'):
        MemoryBank([])
    with pytest.raises(ValueError, match='base must be at least 2; got 1'):
        MemoryBank(bank.elements, base=1)


@pytest.fixture(scope='module')
def coded(bank):
    """The same elements with two check digits: eight words."""
    return MemoryBank(bank.elements, check=2)


def test_one_wrong_or_two_unreadable_elements_are_corrected_and_reported(coded):
    first, _, seal = coded.elements
    assert (coded.size, coded.write(5).wait().corrected) == (8, ())
    digits = coded.digits(5)
    first.write((digits[0] + 1) % 8).wait()
    word = coded.read().wait()
    assert (word.value, word.digits, str(word)) == (5, digits, '5')
    (wrong,) = word.corrected
    assert (wrong.element, wrong.read, wrong.digit, wrong.why) == (first.name, 6, 5, '')
    nobody = MemoryClient(first.node, '/nobody', patience=0.2)
    torn_off = MemoryBank([first, nobody, seal], check=2)
    with pytest.raises(LostWord, match='too far from any word; read, from element 0: 6 '):
        torn_off.read().wait()
    with pytest.raises(BankFailed, match='/nobody: no memory node answers'):
        torn_off.write(6).wait()  # without breaking the seal
    first.erase().wait()
    word = torn_off.read().wait()
    assert word.value == 5
    assert [lost.read for lost in word.corrected] == [-1, None]
    assert 'no memory node answers' in word.corrected[1].why
    assert word.answers[1] is None


def test_a_failed_write_leaves_a_torn_word_and_may_bypass_one_element(coded):
    """The actuator of one is stuck, so it keeps its digit."""
    stuck, _, seal = coded.elements
    coded.write(2).wait()
    stuck.set_parameters({'faults.actuator_stuck': True}).wait()
    writing = coded.write(6)
    with pytest.raises(RequestRefused, match='busy: the bank is being written'):
        coded.write(1).wait()
    with pytest.raises(BankFailed, match='the actuator does not follow'):
        writing.wait()
    with pytest.raises(TornWord, match='torn: a write has not ended'):
        coded.read().wait()
    assert seal.read().wait().blank
    told = coded.write(6, spare=1).wait()
    assert (told.value, [each.element for each in told.corrected]) == (6, [stuck.name])
    assert 'the actuator does not follow' in told.corrected[0].why
    held = coded.read().wait()
    assert (held.value, [each.read for each in held.corrected]) == (6, [coded.digits(2)[0]])
    stuck.set_parameters({'faults.actuator_stuck': False}).wait()
    assert coded.erase().wait().blank
    assert coded.read().wait().blank


def test_a_bank_of_bytes_notices_a_write_that_was_torn():
    """An erased byte reads 0, a digit: so the seal holds a content that is none meanwhile.

    It may try again: while waves of a read run, one loud pulse in fifty leaves a wall behind.
    """
    arguments, elements = bank_arguments(
        ['memory_bank', '--elements=2',
         *node_arguments('/bytes/mlmem', {**QUICK, 'design.preset': 'byte'})]
    )  # fmt: skip
    with (
        NodeHere('/bytes/element_0/mlmem', arguments, elements),
        standalone() as client,
    ):
        bank = MemoryBank.on(client.node, 2, '/bytes', base=128, check=1)
        assert bank.write(77).wait().value == bank.read().wait().value == 77
        deaf, seal = bank.elements
        deaf.set_parameters({'faults.sensor_off': True}).wait()
        with pytest.raises(BankFailed, match='rests in neither phase'):
            bank.write(5).wait()
        assert seal.read().wait().level == 128
        deaf.set_parameters({'faults.sensor_off': False}).wait()
        with pytest.raises(TornWord):
            bank.read().wait()
        assert bank.erase().wait().value == bank.read().wait().value == 0
        with pytest.raises(BankFailed, match='from 0 to 255; got 256, which marks a write'):
            MemoryBank(bank.elements, base=256, check=1).write(1).wait()


def test_a_spare_out_of_range_is_refused(coded):
    with pytest.raises(ValueError, match='spare must be from 0 to 1; got 2'):
        coded.write(1, spare=2)


def test_the_heading_store(bank, monkeypatch, capsys):
    """The example: one run of the program finds what the previous one stored."""
    example = runpy.run_path(str(Path(__file__).parents[2] / 'examples' / 'heading_store.py'))

    def heading_store(*arguments):
        monkeypatch.setattr(sys, 'argv', ['heading_store.py', *arguments])
        assert example['main']() == 0
        return capsys.readouterr().out

    bank.erase().wait()
    assert heading_store('10') == 'no heading is stored\nstored as digits 0 1 2\n'
    assert heading_store() == 'heading 10 degrees, digits 0 1 2\n'


def test_a_bank_serves_actions_only_on_request():
    """They are thirty endpoints an element: a hundred elements with them start in a minute."""
    alone = bank_arguments(['memory_bank', '--elements', '2'])[0]
    asked = bank_arguments(['memory_bank', '--elements', '2', '--actions'])[0]
    assert 'actions:=false' in alone
    assert 'actions:=false' not in asked


@pytest.mark.parametrize('wanted', [True, False])
def test_a_node_serves_actions_unless_it_is_told_not_to(start, wanted):
    start({'autostart': False, 'actions': wanted})
    with Robot() as robot:
        assert robot.get('actions') == wanted
        services = dict(robot.node.get_service_names_and_types())
    for name, built in (('write', action_types()), ('simulate_steps', simulator.types())):
        served = f'/mlmem/{name}/_action/send_goal' in services
        assert served == (wanted and bool(built)), name
