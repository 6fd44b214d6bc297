# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Two nodes of one name: the second says so, in a word."""

import time

import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor

from mlmem_ros.ros.node.namesakes import LOOKS
from mlmem_ros.ros.node.node import MemoryNode

WARNING = 'another node named /twin is there'


@pytest.fixture
def context():
    context = rclpy.Context()
    rclpy.init(args=[], context=context)
    yield context
    rclpy.shutdown(context=context)


def test_a_second_node_of_the_name_says_so_once(context, capfd):
    first = rclpy.create_node('twin', context=context)
    second = MemoryNode('twin', context=context)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(second)
    told, deadline = '', time.monotonic() + 15.0
    while WARNING not in told:
        assert time.monotonic() < deadline
        executor.spin_once(timeout_sec=0.1)
        told += ''.join(capfd.readouterr())
    assert second._namesakes._timer not in second.timers  # it looks no more
    first.destroy_node()
    second.destroy_node()


def test_a_node_that_is_alone_says_nothing(context, capfd):
    alone = MemoryNode('single', context=context)
    rclpy.create_node('single', namespace='/other', context=context)
    for _ in range(LOOKS):
        alone._namesakes.look()
    assert alone._namesakes._timer not in alone.timers
    assert 'another node named /single' not in ''.join(capfd.readouterr())
