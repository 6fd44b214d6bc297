# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Two nodes with one full name: each logs it, once."""

import time

import pytest
from nodes import QUICK, node_parameters
from robot import Robot

from mlmem_ros.ros.node import starting
from mlmem_ros.testing import memory_node
from mlmem_tools.cli.main import main

BY_HAND = {'autostart': False}


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    monkeypatch.setattr(starting, 'CHECK_PERIOD_S', 0.1)


def test_second_node_of_one_name_is_logged_once():
    with (
        memory_node(BY_HAND, name='twin'),
        memory_node(BY_HAND, name='twin') as second,
        memory_node(BY_HAND, name='single', namespace='/other') as other,
        Robot(name='single'),
    ):
        time.sleep(
            1.5 * starting.MAX_CHECKS * starting.CHECK_PERIOD_S
        )  # until all have done all their checks
        assert second.output.count('another node named /twin is running') == 1
        assert other.output == ''


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
