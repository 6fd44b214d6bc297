# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Optional packages are imported only where needed; an error says how to install them."""

import subprocess
import sys

import pytest

from mlmem_ros import packages

HIDDEN = """
import sys
sys.modules.update(dict.fromkeys('mcap rosbags lz4 zstandard scipy matplotlib rich PIL'.split()))
"""


def python(code, *arguments):
    """Run code without the packages that a node does not need."""
    command = [sys.executable, '-c', HIDDEN + code, *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)


def test_command_names_the_missing_package():
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
def test_advice_fits_the_missing_package(name, words):
    said = packages.describe_missing(ModuleNotFoundError('no such thing', name=name))
    assert all(word in said for word in words)
    assert '\n' not in said


@pytest.mark.parametrize('library', packages.TESTED_LIBRARIES)
def test_installed_library_is_a_tested_version(library):
    """We use private names of it: every node and client of the tests does."""
    pytest.importorskip(library)
    assert packages.is_version_tested(library), packages.find_library_version(library)
