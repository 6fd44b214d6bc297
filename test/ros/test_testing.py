# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A memory node for the length of a test: here and apart."""

import pytest
from robot import Robot

from mlmem_ros.ros.node.parameters import ParameterError
from mlmem_ros.testing import memory_node

QUICK = {'scale.time': 1e-5}


@pytest.mark.parametrize('apart', [False, True])
def test_a_node_has_a_name_parameters_a_log_and_an_end(tmp_path, apart):
    file = tmp_path / 'given.yaml'
    file.write_text('/**:\n  ros__parameters:\n    write: {hold: 250.0}\n')
    options = {'name': 'lent', 'namespace': '/arm', 'file': file, 'apart': apart}
    with memory_node(QUICK, **options) as node:
        assert (node.element, node.memory.name) == ('/arm/lent', '/arm/lent')
        assert node.memory.parameters('write.hold', 'scale.time').wait() == {
            'write.hold': 250.0,
            'scale.time': 1e-5,
        }
        assert node.memory.write(2).wait().level == 2
        assert 'ready: 8 levels' in node.output
        assert node.running
        node.terminate()
        assert node.exit_status() == 0
        assert not node.running
    with Robot() as robot:
        assert 'lent' not in robot.node.get_node_names()


def test_two_nodes_here_are_two_elements():
    with memory_node(QUICK, name='left') as left, memory_node(QUICK, name='right') as right:
        written = left.memory.write(1), right.memory.write(6)
        assert [reply.wait().level for reply in written] == [1, 6]


def test_what_cannot_start_raises_and_leaves_nothing_behind():
    reason = 'target_level must be from 0 to 7; got 9'
    with (
        pytest.raises(ParameterError, match=reason),
        memory_node({'target_level': 9}, name='never'),
    ):
        pass
    with Robot() as robot:
        assert 'never' not in robot.node.get_node_names()
