# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Two nodes with one full name: the command line says so."""

from nodes import QUICK, node_parameters
from robot import Robot

from mlmem_ros.testing import memory_node
from mlmem_tools.cli.main import main


def test_command_to_two_nodes_of_one_name_warns(capsys):
    with memory_node(node_parameters(QUICK), name='twin'):
        assert main(['read', '--node', 'twin']) == 0
        assert capsys.readouterr().err.count('nodes of this name') == 0
        given = node_parameters(QUICK)
        with memory_node(given, name='twin') as second, Robot(second.element) as robot:
            robot.wait(lambda: robot.node.count_publishers('/twin/alive') == 2, 'both')
            # A command that is answered before it has discovered the other node cannot warn.
            for _ in range(10):
                assert main(['read', '--node', 'twin', '--wait', '20']) == 0
                if warning := capsys.readouterr().err:
                    break
            assert 'mlmem read: 2 nodes of this name are on the graph' in warning
