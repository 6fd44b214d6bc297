# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Optional packages, the laboratory among them: an error says in one line how to install them."""

import subprocess
import sys
from importlib.metadata import EntryPoints
from pathlib import Path

import pytest

from mlmem_ros import packages
from mlmem_tools.cli import laboratory
from mlmem_tools.cli import main as cli

INSPECT_WITHOUT_PACKAGES = """
import sys
sys.modules.update(dict.fromkeys('mcap rosbags lz4 zstandard scipy matplotlib rich PIL'.split()))
import mlmem_tools.cli.main as cli
sys.exit(cli.main(['inspect', 'bag']))
"""


def test_command_names_the_missing_package():
    command = [sys.executable, '-c', INSPECT_WITHOUT_PACKAGES]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 1
    assert done.stderr.startswith('mlmem inspect: the Python package ')
    assert 'install' in done.stderr
    assert done.stderr.count('\n') == 1


@pytest.mark.parametrize(
    ('name', 'words'),
    [
        ('std_msgs.msg', ['ROS 2', '/opt/ros/jazzy/setup.bash', 'ros-jazzy-rclpy']),
        ('mcap.writer', ['package mcap', 'pip install mcap', '--break-system-packages']),
        ('yaml', ['pip install pyyaml']),
    ],
)
def test_advice_fits_the_missing_package(name, words):
    said = packages.describe_missing(ModuleNotFoundError('no such thing', name=name))
    assert all(word in said for word in words)
    assert '\n' not in said


@pytest.mark.parametrize(
    'words',
    [
        *([name, '--json'] for name in laboratory.LABORATORY_COMMANDS),
        ['design', '--levels', '2'],
        ['design', 'prove', 'bits_1'],
        ['inspect', str(Path(__file__).parent / 'data/life'), '--plot', 'session.png'],
    ],
    ids=lambda words: f'{words[0]} {words[-1]}',
)
def test_command_without_the_laboratory_says_what_to_install(words, monkeypatch, capsys):
    monkeypatch.setattr(packages, 'entry_points', lambda group: EntryPoints())
    assert cli.main(words) == 1
    assert 'the laboratory is missing; in a checkout: pip install' in capsys.readouterr().err
