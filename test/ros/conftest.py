# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An element that the tests of a module share, a robot that talks to it, and refused starts."""

from __future__ import annotations

import signal
import threading
from contextlib import ExitStack

import pytest
import rclpy
from nodes import node_parameters
from robot import Robot, join_graph
from suite import TIMEOUT_S

from mlmem_ros import standalone
from mlmem_ros.ros.node import diagnostics
from mlmem_ros.ros.node.node import MemoryNode
from mlmem_ros.ros.node.run import NOT_STARTED, run_nodes
from mlmem_ros.ros.node_process import build_node_arguments


@pytest.fixture
def context():
    """A context of rclpy's of its own."""
    context = rclpy.Context()
    rclpy.init(args=[], context=context)
    yield context
    rclpy.try_shutdown(context=context)


@pytest.fixture
def destroyed():
    """Nodes that are destroyed after the test."""
    nodes = []
    yield nodes
    for node in nodes:
        node.destroy_node()


@pytest.fixture
def create_node(context, destroyed):
    """Create nodes in that context, in no executor: create_node('robot')."""

    def create_node(name, **options):
        options |= {'context': context, 'use_global_arguments': False}
        destroyed.append(rclpy.create_node(name, **options))
        return destroyed[-1]

    return create_node


@pytest.fixture
def declared(destroyed):
    """Declare the parameters of a node given some: declared({'element': 'bits_1'})."""

    def declare(given=(), namespace=''):
        own = node_parameters(dict(given))
        node = MemoryNode('memory', parameters=own, namespace=namespace, context=join_graph())
        destroyed.append(node)
        return node, node._given

    return declare


@pytest.fixture
def refused(capfd):
    """Start the program with bad input: refused(parameters, ...) returns the line it ends with."""

    def refused(parameters=None, *, file=None, options=()):
        given, stop = build_node_arguments('mlmem', node_parameters(parameters or {}), file), []
        capfd.readouterr()
        ends = threading.Timer(TIMEOUT_S, stop.append, [signal.SIGTERM])  # if it starts after all
        ends.start()
        try:
            assert run_nodes(['memory_node', *given, *options], stop) == NOT_STARTED
        finally:
            ends.cancel()
            rclpy.try_shutdown()
        said = capfd.readouterr().err.splitlines()
        assert not [line for line in said if line.startswith('Traceback')], said
        lines = [line for line in said if line.startswith('[') and not line.startswith('[INFO]')]
        if '[rcl]: Failed to parse global arguments' in lines[0]:  # rcl's own, without a reason
            lines.pop(0)
        assert [line.startswith('[FATAL]') for line in lines] == [True], said
        return lines[0]

    return refused


@pytest.fixture(scope='module', autouse=True)
def observed_nodes(one_owner):
    """Let nodes of this process report to /diagnostics ten times a second, instead of once, and
    watch who touches their devices (see `one_owner`).
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(diagnostics, 'REPORT_PERIOD_S', 0.1)
        yield


@pytest.fixture(scope='module')
def memory(request, start_shared):
    """An element for all tests of a module, with its parameters `GIVEN` beside `nodes.QUICK`."""
    return start_shared(getattr(request.module, 'GIVEN', {'actions': True}))


@pytest.fixture(scope='module')
def robot(memory):
    """A robot that talks to that element."""
    with Robot(memory.element) as robot:
        yield robot


@pytest.fixture
def start_robot(start):
    """Start a node for one test, its `memory`, and return a robot that talks to it."""
    with ExitStack() as robots:

        def start_robot(*given, **options):
            memory = start(*given, **options)
            robot = robots.enter_context(Robot(memory.element))
            robot.memory = memory
            return robot

        yield start_robot


@pytest.fixture(scope='module')
def client(memory):
    """A client of that element, for a program without a node."""
    with standalone(memory.element) as client:
        client.ready(TIMEOUT_S).wait()
        yield client
