# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A ROS graph of our own: its domain, its discovery over the loopback, its log directory."""

from __future__ import annotations

import contextlib
import importlib.util
import signal
import subprocess
import sys
from pathlib import Path

import pytest

pytest.register_assert_rewrite('mlmem_ros.testing')  # a plugin of some tests, too

from mlmem_ros.testing import isolate  # noqa: E402

sys.path.append(str(Path(__file__).parent))  # robot.py
HAVE_ROS = importlib.util.find_spec('rclpy') is not None

if HAVE_ROS:
    isolate()
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:  # started with & from a script:
        signal.signal(signal.SIGINT, signal.default_int_handler)  # children would inherit it


class NeedsRos(pytest.Module):
    """A test module that is not even imported where there is no ROS."""

    def collect(self):
        pytest.skip('rclpy is not installed', allow_module_level=True)


def pytest_pycollect_makemodule(module_path, parent):
    return None if HAVE_ROS else NeedsRos.from_parent(parent, path=module_path)


@contextlib.contextmanager
def emulated_rig(*options):
    """Run an emulated rig in a process of its own; return its address."""
    command = [sys.executable, '-m', 'mlmem_ros.cli.main', 'rig', *options]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            yield process.stdout.readline().strip()
        finally:
            process.terminate()


LINE = ('--latency', '0.002', '--jitter', '0.003', '--loss', '0.002', '--drift', '1e-4')
"""Of a rig that is up to 5 ms away: frames get lost, and its clock is not ours."""


@contextlib.contextmanager
def starting(driver='sim'):
    """Start nodes, as many as are asked for, and end all of them; each has a rig of its own."""
    from mlmem_ros.testing import memory_node

    with contextlib.ExitStack() as nodes:

        def start(parameters=None, **options):
            given = dict(parameters or {})
            if options.get('apart'):  # a new process has no design check to remember
                given.setdefault('design.check', 'skip')
            if driver == 'rig':
                scale = str(given.get('scale.time', 1e-4))
                address = nodes.enter_context(emulated_rig('--scale-time', scale, *LINE))
                given |= {
                    'device.driver': 'rig',
                    'device.address': f'{address}?lead=0.2&patience=10',
                }
            return nodes.enter_context(memory_node(given, **options))

        yield start


@pytest.fixture(scope='module')
def driver():
    """What drives the elements of a module's nodes."""
    return 'sim'


@pytest.fixture
def start(driver):
    """Start a node: start(parameters, ...), as `memory_node`."""
    with starting(driver) as start:
        yield start


@pytest.fixture(scope='module')
def start_shared(driver):
    """Start a node for all tests of a module."""
    with starting(driver) as start:
        yield start


@pytest.fixture
def refused(capfd):
    """Start the program with what it refuses: refused(parameters, ...), the line it ends with."""
    import rclpy

    from mlmem_ros.ros.node.run import NOT_STARTED, run
    from mlmem_ros.ros.node_process import node_arguments

    def refused(parameters=None, *, name='mlmem', file=None, options=(), warned=False):
        given = node_arguments(name, parameters, file)
        capfd.readouterr()
        try:
            assert run(['memory_node', *given, *options], stop=[signal.SIGTERM]) == NOT_STARTED
        finally:
            rclpy.try_shutdown()
        said = capfd.readouterr().err.splitlines()
        assert not [line for line in said if line.startswith('Traceback')], said
        harmless = ('[INFO]', '[WARN]') if warned else '[INFO]'  # other nodes warn here, too
        lines = [line for line in said if line.startswith('[') and not line.startswith(harmless)]
        if '[rcl]: Failed to parse global arguments' in lines[0]:  # rcl's own, which says nothing
            lines.pop(0)
        assert len(lines) == 1, said
        (line,) = lines
        assert line.startswith('[FATAL]')
        return line

    return refused


@pytest.fixture(scope='module')
def memory(start_shared):
    """Run the eight-level element ten times faster than a robot would, for all of a module."""
    return start_shared({'scale.time': 1e-5})


@pytest.fixture(scope='module')
def robot(memory):
    """Talk to that element."""
    from robot import Robot

    with Robot(memory.element) as robot:
        yield robot
