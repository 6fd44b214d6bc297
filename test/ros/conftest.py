# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A ROS graph of our own: its domain, its discovery over the loopback, its log directory."""

from __future__ import annotations

import atexit
import contextlib
import fcntl
import importlib.util
import os
import shutil
import signal
import sys
import tempfile
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parent))  # robot.py
HAVE_ROS = importlib.util.find_spec('rclpy') is not None

# The defaults take up to 3 s to discover a peer and leave segments in /dev/shm after a SIGKILL.
FAST_DISCOVERY = """<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles">
  <profiles>
    <transport_descriptors>
      <transport_descriptor>
        <transport_id>loopback</transport_id>
        <type>UDPv4</type>
        <interfaceWhiteList><address>127.0.0.1</address></interfaceWhiteList>
        <maxInitialPeersRange>32</maxInitialPeersRange>
      </transport_descriptor>
    </transport_descriptors>
    <participant profile_name="loopback" is_default_profile="true">
      <rtps>
        <useBuiltinTransports>false</useBuiltinTransports>
        <userTransports><transport_id>loopback</transport_id></userTransports>
        <builtin>
          <discovery_config>
            <leaseAnnouncement><sec>0</sec><nanosec>200000000</nanosec></leaseAnnouncement>
            <initialAnnouncements>
              <count>10</count><period><sec>0</sec><nanosec>50000000</nanosec></period>
            </initialAnnouncements>
          </discovery_config>
        </builtin>
      </rtps>
    </participant>
  </profiles>
</dds>
"""


def claim_domain():
    """Return a ROS domain that no other run of these tests has on this machine."""
    for offset in range(100):
        domain = 1 + (os.getpid() + offset) % 100
        path = Path(tempfile.gettempdir(), f'mlmem-ros-domain-{domain}.lock')
        lock = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)  # held until this process ends
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(lock)
        else:
            return domain
    raise RuntimeError('all ROS domains from 1 to 100 are in use by runs of these tests')


def isolate():
    """Set the environment of this process and all it starts, before rclpy is imported."""
    home = Path(tempfile.mkdtemp(prefix='mlmem-ros-'))
    atexit.register(shutil.rmtree, home, ignore_errors=True)
    profile = home / 'fast_discovery.xml'
    profile.write_text(FAST_DISCOVERY)
    os.environ.update(
        ROS_DOMAIN_ID=str(claim_domain()),
        ROS_AUTOMATIC_DISCOVERY_RANGE='LOCALHOST',
        ROS_LOG_DIR=str(home / 'log'),
        ROS_PYTHON_CHECK_FIELDS='1',
        RMW_IMPLEMENTATION='rmw_fastrtps_cpp',
        FASTRTPS_DEFAULT_PROFILES_FILE=str(profile),
    )
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:  # started with & from a script:
        signal.signal(signal.SIGINT, signal.default_int_handler)  # children would inherit it


if HAVE_ROS:
    isolate()


class NeedsRos(pytest.Module):
    """A test module that is not even imported where there is no ROS."""

    def collect(self):
        pytest.skip('rclpy is not installed', allow_module_level=True)


def pytest_pycollect_makemodule(module_path, parent):
    return None if HAVE_ROS else NeedsRos.from_parent(parent, path=module_path)


@contextlib.contextmanager
def starting():
    """Start nodes, as many as are asked for, and end all of them."""
    from mlmem_ros.testing import memory_node

    with contextlib.ExitStack() as nodes:
        yield lambda *given, **options: nodes.enter_context(memory_node(*given, **options))


@pytest.fixture
def start():
    """Start a node: start(parameters, ...), as `memory_node`."""
    with starting() as start:
        yield start


@pytest.fixture(scope='module')
def start_shared():
    """Start a node for all tests of a module."""
    with starting() as start:
        yield start


@pytest.fixture
def refused(capfd):
    """Start the program with what it refuses: refused(parameters, ...), the line it ends with."""
    import rclpy

    from mlmem_ros.ros.node.run import NOT_STARTED, run
    from mlmem_ros.testing.node import ros_arguments

    def refused(parameters=None, *, name='mlmem', file=None, options=(), warned=False):
        given = ros_arguments(parameters or {}, name, '', file)
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
