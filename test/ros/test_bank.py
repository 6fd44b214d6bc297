# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Several elements in one process, and one value in three of them, with a check digit."""

import itertools

import pytest
from nodes import QUICK, element_file, node_parameters
from robot import Robot
from suite import TIMEOUT_S

from mlmem import SettingsError
from mlmem_ros import BankCheckFailed, BankFailed, MemoryBank, MemoryClient, RequestRefused
from mlmem_ros.ros.client.client import standalone, wait_until
from mlmem_ros.ros.main import parse_bank_arguments
from mlmem_ros.ros.node.run import NOT_SAVED
from mlmem_ros.ros.node_process import build_node_arguments
from mlmem_ros.testing.running import NodeHere

ELEMENTS = 3


def run_bank(name, *options, **node):
    """Return a running bank, whose elements lie next to a node of this name."""
    namespace, _, own = name.rpartition('/')
    given = [
        'memory_bank',
        f'--elements={ELEMENTS}',
        *options,
        *build_node_arguments(name, **node),
    ]
    return NodeHere(f'{namespace or "/bank"}/element_0/{own}', *parse_bank_arguments(given))


@pytest.fixture(scope='module')
def bank():
    """What bank.launch.py starts, of small elements."""
    given = node_parameters(QUICK | {'write.attempts': 1})
    with run_bank('mlmem', parameters=given), standalone() as client:
        bank = MemoryBank.on(client.node, ELEMENTS)
        bank.ready(TIMEOUT_S).wait()
        yield bank


def test_bank_reads_the_value_that_was_written(bank):
    written = bank.write(0o13).wait()
    assert (written.value, written.digits, written.recovered) == (0o13, (3, 1, 4), '')
    assert bank.read(end='both').wait() == written
    alone = MemoryClient(bank.elements[0].node, '/bank/element_1/mlmem')
    assert alone.read().wait().level == 1
    assert bank.erase().wait() == bank.read().wait()
    assert bank.read().wait().digits == (-1, -1, -1)


def test_bank_writes_all_elements_at_the_same_time(bank):
    """While one element is paused, the others are written."""
    first, *others = bank.elements
    with Robot(first.name) as holder, holder.paused():
        writing = bank.write(0o21)
        for other, level in zip(others, (2, 5), strict=True):
            with Robot(other.name) as robot:
                robot.latest('level', lambda message: message.data == level)  # noqa: B023
        assert not writing.done()
    assert writing.wait().value == 0o21


@pytest.mark.parametrize('value', [64, -1, 1.0, True, '7'])
def test_value_that_does_not_fit_is_rejected(bank, value):
    with pytest.raises(ValueError, match=r'^value'):
        bank.write(value)


def test_digits_of_every_value_decode_to_it(bank):
    assert [bank.decode(bank.encode(value)).value for value in range(bank.size)] == [*range(64)]
    assert MemoryBank(bank.elements, base=256).encode(0xA7FF) == (0xFF, 0xA7, 0x5A)


def test_one_wrong_digit_is_always_detected(bank):
    """So is a torn write: of three elements, one has another age than the other two."""
    for digits in map(bank.encode, range(bank.size)):
        for place, wrong in itertools.product(range(ELEMENTS), range(-1, 9)):
            if wrong != digits[place]:
                with pytest.raises(BankCheckFailed) as failure:
                    bank.decode([*digits[:place], wrong, *digits[place + 1 :]])
                assert failure.value.digits[place] == wrong


def test_lost_digit_is_recovered_wherever_it_was(bank):
    digits = bank.encode(0o13)
    for place in range(ELEMENTS):
        found = bank.decode([*digits[:place], None, *digits[place + 1 :]])
        assert (found.value, found.digits) == (0o13, digits)
        assert found.recovered == bank.elements[place].name


def test_bank_recovers_an_element_that_cannot_be_read(bank):
    bank.write(0o13).wait()
    deaf, other, _ = bank.elements
    deaf.set_parameters({'faults.sensor_off': True}).wait()
    try:
        found = bank.read().wait()
        assert (found.value, found.recovered) == (0o13, deaf.name)
        nobody = MemoryClient(other.node, '/nobody', patience=0.2)
        with pytest.raises(BankFailed) as failure:
            MemoryBank([deaf, nobody, bank.elements[2]]).read().wait()
        assert list(failure.value.errors) == [deaf.name, '/nobody']
    finally:
        deaf.set_parameters({'faults.sensor_off': False}).wait()
    assert bank.read().wait().recovered == ''


def test_bank_with_a_failed_write_reads_no_value(bank):
    """The transducers of one element do not kick for a while, so it keeps its digit."""
    bank.write(2).wait()
    idle = bank.elements[0]
    idle.set_parameters({'faults.transducer_off': True}).wait()
    try:
        with pytest.raises(BankFailed, match='level 6 was not reached'):
            bank.write(0o16).wait()
    finally:
        idle.set_parameters({'faults.transducer_off': False}).wait()
    with pytest.raises(BankCheckFailed) as failure:
        bank.read().wait()
    assert failure.value.digits == (2, 1, 1)


def test_base_above_the_levels_of_an_element_fails(bank):
    with pytest.raises(BankFailed, match='from 0 to 7; got 9') as failure:
        MemoryBank(bank.elements, base=10).write(9).wait()
    assert {type(error) for error in failure.value.errors.values()} == {RequestRefused}


@pytest.mark.parametrize(('count', 'base', 'field'), [(1, 8, 'elements'), (3, 1, 'base')])
def test_bank_without_a_check_element_is_rejected(bank, count, base, field):
    with pytest.raises(ValueError, match=f'^{field}'):
        MemoryBank(bank.elements[:count], base=base)


def test_elements_of_a_bank_fail_independently(tmp_path, capfd):
    """They record and keep their content; the state file of the second is damaged."""
    states, bags, file = tmp_path / 'states', tmp_path / 'bags', tmp_path / 'bank.yaml'
    states.mkdir()
    (states / 'element_1.json').write_text('what a disk had left of it')
    element = element_file('case_2', {'scale.time': 1e-5})
    file.write_text(f"""
/**:
  ros__parameters:
    {{element: {element}, write.method: kick, design.check: skip, write.attempts: 5}}
/robot/bank/element_2/mlmem:
  ros__parameters: {{write.attempts: 7}}
""")
    options = ('--state', str(states), '--record', str(bags))
    with run_bank('/robot/bank/mlmem', *options, file=file) as bank, standalone() as client:
        names = [node.get_fully_qualified_name() for node in bank.nodes]
        first, damaged, other = (MemoryClient(client.node, name) for name in names)
        assert '/robot/bank/element_1 cannot start: ' in capfd.readouterr().err
        with pytest.raises(RequestRefused, match='inactive'):
            damaged.read().wait()
        attempts = [each.parameters('write.attempts').wait() for each in (first, other)]
        assert [values['write.attempts'] for values in attempts] == [5, 7]

        writing = first.write(2), other.write(5)
        assert [reply.wait().level for reply in writing] == [2, 5]
        host = bank.nodes[0].host
        host.open_loop().call(lambda: setattr(host.element, 'advance', None))
        wait_until(lambda: host.element is None, 'the end of the first device', TIMEOUT_S)
        assert 'the device has stopped' in bank.output
        assert other.read().wait().level == 5
        assert bank.running

        bank.terminate()
        assert bank.exit_status() == NOT_SAVED
        assert bank.output.count('shut down; not all was saved') == 1
    assert {path.name for path in bags.iterdir()} == {'element_0', 'element_2'}
    assert (states / 'element_1.json').read_text().startswith('what a disk')


def test_bank_without_a_working_element_does_not_start():
    with pytest.raises(SettingsError, match='element must be one of'):
        run_bank('mlmem', parameters={'element': 'none'})


def test_bank_command_line_gives_names_and_files():
    given = ['memory_bank', '--elements=2', '--state', '/var/bank', '--ros-args']
    rest, elements = parse_bank_arguments(
        [*given, '-p', 'linger:=1.0', '-r', '__ns:=/leg/', '-r', 'a:=b']
    )
    without_actions = ['--ros-args', '-p', 'actions:=false']
    kept = ['memory_bank', '--ros-args', '-p', 'linger:=1.0', '-r', 'a:=b']
    assert rest == [*kept, *without_actions]
    assert 'actions:=false' not in parse_bank_arguments(['memory_bank', '--actions'])[0]
    assert elements == [
        {'namespace': f'/leg/element_{place}', 'state.path': f'/var/bank/element_{place}.json'}
        for place in range(2)
    ]
    namespaces = [each['namespace'] for each in parse_bank_arguments(['memory_bank'])[1]]
    assert namespaces == [f'/bank/element_{place}' for place in range(4)]


@pytest.mark.parametrize('number', ['0', '129', '-1', '2.5', 'four'])
def test_bank_has_1_to_128_elements(number):
    with pytest.raises(SystemExit):
        parse_bank_arguments(['memory_bank', f'--elements={number}'])
