# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Optional packages are imported only where needed; an error says how to install them."""

import subprocess
import sys

import pytest

from mlmem_ros import packages
from mlmem_tools.cli.main import main

HIDDEN = """
import sys
sys.modules.update(dict.fromkeys('mcap rosbags lz4 zstandard scipy matplotlib rich PIL'.split()))
"""


def python(code, *arguments):
    """Run code without the packages that a node does not need."""
    command = [sys.executable, '-c', HIDDEN + code, *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)


def test_a_device_needs_numpy_and_numba_its_host_no_bag_libraries_and_a_node_says_what_it_lacks():
    """They cannot record; the refusal says what to install. A robot has a node as from apt."""
    done = python(
        """
of_a_node = 'rclpy std_msgs yaml'.split()
sys.modules.update(dict.fromkeys(of_a_node))
import mlmem
for name in of_a_node:
    del sys.modules[name]
from types import SimpleNamespace
import pytest
from mlmem_ros.bag.errors import BagError
from mlmem_ros.host import Host, SessionPlan
from mlmem_ros.host.settings import RecordSettings
sessions = Host(SimpleNamespace(), lambda: 0).sessions
with pytest.raises(BagError, match='Cannot record: the Python package (mcap|rosbags) is missing: '
                   'python3 -m pip install mcap rosbags ') as refused:
    sessions.begin(SessionPlan('/mlmem', RecordSettings('nowhere')), SimpleNamespace(procedure=''))
assert '\\n' not in str(refused.value)
print('the host has refused', flush=True)
from mlmem_ros.ros.main import main; sys.exit(main())
""",
        *('--ros-args', '-p', 'design.check:=skip', '-p', 'record.path:=nowhere'),
    )
    assert done.stdout.startswith('the host has refused\n'), done.stderr
    pytest.importorskip('rclpy')
    assert done.returncode == 1
    last = done.stderr.splitlines()[-1]
    assert last.startswith('[FATAL]')
    assert 'is missing: python3 -m pip install mcap rosbags ' in last
    assert 'Traceback' not in done.stderr


def test_a_command_names_the_missing_package():
    done = python(
        'import mlmem_tools.cli.main as cli; sys.exit(cli.main(sys.argv[1:]))', 'inspect', 'bag'
    )
    assert done.returncode == 1
    assert done.stderr.startswith('mlmem inspect: the Python package ')
    assert 'install' in done.stderr
    assert done.stderr.count('\n') == 1


@pytest.mark.parametrize(
    ('name', 'words'),
    [
        ('std_msgs.msg', ['ROS 2', '/opt/ros/jazzy/setup.bash', 'ros-jazzy-rclpy']),
        ('mcap.writer', ['package mcap', 'pip install mcap rosbags', '--break-system-packages']),
        ('yaml', ['apt install python3-yaml', 'pip install pyyaml']),
        ('distributed', ['pip install distributed']),
    ],
)
def test_advice_fits_the_package(name, words):
    said = packages.describe_missing(ModuleNotFoundError('no such thing', name=name))
    assert all(word in said for word in words)
    assert '\n' not in said


def test_the_command_needs_no_package():
    with pytest.raises(SystemExit) as told:
        main(['--help'])
    assert told.value.code == 0


@pytest.mark.parametrize('library', packages.TESTED_LIBRARIES)
def test_installed_library_is_a_tested_version(library):
    """We use private names of it: every node and client of the tests does."""
    pytest.importorskip(library)
    assert packages.is_version_tested(library), packages.find_library_version(library)
