# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Several elements in one process have separate names, files and failures."""

import pytest
from nodes import element_file

from mlmem import SettingsError
from mlmem_ros import MemoryClient, RequestRefused, standalone
from mlmem_ros.ros.client.client import wait_until
from mlmem_ros.ros.main import parse_bank_arguments
from mlmem_ros.ros.node.run import NOT_SAVED
from mlmem_ros.ros.node_process import build_node_arguments
from mlmem_ros.testing.running import NodeHere

ELEMENTS = 3


@pytest.fixture
def bank(tmp_path, capfd):
    """Three elements that record and keep their content; the state file of one is damaged."""
    states, file = tmp_path / 'states', tmp_path / 'bank.yaml'
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
    arguments, elements = parse_bank_arguments(
        [
            'memory_bank',
            '--elements',
            f'{ELEMENTS}',
            '--state',
            str(states),
            '--record',
            str(tmp_path / 'bags'),
            *build_node_arguments('/robot/bank/mlmem', file=file),
        ]
    )
    with NodeHere('/robot/bank/element_0/mlmem', arguments, elements) as bank:
        yield bank


@pytest.fixture
def elements(bank):
    with standalone() as client:
        yield [MemoryClient(client.node, node.get_fully_qualified_name()) for node in bank.nodes]


def test_elements_of_a_bank_fail_independently(bank, elements, tmp_path, capfd):
    first, damaged, other = elements
    assert '/robot/bank/element_1 cannot start: ' in capfd.readouterr().err
    with pytest.raises(RequestRefused, match='inactive: configure and activate the node first'):
        damaged.read().wait()
    attempts = [each.parameters('write.attempts').wait() for each in (first, other)]
    assert [given['write.attempts'] for given in attempts] == [5, 7]

    writing = first.write(2), other.write(5)
    assert [reply.wait().level for reply in writing] == [2, 5]
    node = bank.nodes[0]
    node.host.open_loop().call(lambda: setattr(node.host.element, 'advance', None))
    wait_until(lambda: node.host.element is None, 'the end of the first device', 20.0)
    assert 'the device has stopped' in bank.output
    assert other.read().wait().level == 5
    assert bank.running

    bank.terminate()
    assert bank.exit_status() == NOT_SAVED
    assert bank.output.count('shut down; not all was saved') == 1
    assert {path.name for path in (tmp_path / 'bags').iterdir()} == {'element_0', 'element_2'}
    assert (tmp_path / 'states' / 'element_1.json').read_text().startswith('what a disk')


def test_bank_without_a_working_element_does_not_start():
    arguments, elements = parse_bank_arguments(
        [
            'memory_bank',
            '--elements=2',
            *build_node_arguments('mlmem', {'element': 'none'}),
        ]
    )
    with pytest.raises(SettingsError, match='element must be one of'):
        NodeHere('/bank/element_0/mlmem', arguments, elements)


def test_bank_command_line_gives_names_and_files():
    given = ['memory_bank', '--elements=2', '--state', '/var/bank', '--ros-args']
    rest, elements = parse_bank_arguments(
        [*given, '-p', 'view:=true', '-r', '__ns:=/leg/', '-r', 'a:=b']
    )
    quiet = ['--ros-args', '-p', 'actions:=false']
    assert rest == ['memory_bank', '--ros-args', '-p', 'view:=true', '-r', 'a:=b', *quiet]
    assert 'actions:=false' not in parse_bank_arguments(['memory_bank', '--actions'])[0]
    assert elements == [
        {'namespace': f'/leg/element_{place}', 'state.path': f'/var/bank/element_{place}.json'}
        for place in range(2)
    ]
    assert [each['namespace'] for each in parse_bank_arguments(['memory_bank'])[1]] == [
        f'/bank/element_{place}' for place in range(4)
    ]


@pytest.mark.parametrize('number', ['0', '129', '-1', '2.5', 'four'])
def test_bank_has_1_to_128_elements(number, capsys):
    with pytest.raises(SystemExit):
        parse_bank_arguments(['memory_bank', f'--elements={number}'])
    assert f"must be a number from 1 to 128; got '{number}'" in capsys.readouterr().err
