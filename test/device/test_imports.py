# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Imports run one way: the device knows the material, and numpy and numba are all it needs."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import mlmem_ros.device

SOURCES = sorted(Path(mlmem_ros.device.__file__).parent.glob('*.py'))


def imported(source):
    """Return the modules a file imports, relative ones written out."""
    found = set()
    for node in ast.walk(ast.parse(source.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            above = ['mlmem_ros', 'device'][: 3 - node.level] if node.level else []
            found.add('.'.join([*above, node.module or '']))
            found |= {f'{".".join([*above, node.module or ""])}.{a.name}' for a in node.names}
    return found


@pytest.mark.parametrize('source', SOURCES, ids=lambda path: path.stem)
def test_no_part_of_the_device_looks_at_the_true_wall(source):
    """Neither the module that finds walls nor a function from it; see also test_procedures."""
    names = imported(source)
    assert not [name for name in names if name.endswith(('.wall', '.walls', '.Wall'))]
    assert not [name for name in names if name.startswith(('mlmem_ros.bag', 'mlmem_ros.ros'))]


def test_the_device_can_be_imported_with_numpy_and_numba_alone():
    """Everything else that the package uses elsewhere cannot be found."""
    code = """
import sys
foreign = 'rclpy std_msgs yaml mcap rosbags scipy matplotlib rich'.split()
sys.modules.update(dict.fromkeys(foreign))
import mlmem_ros.device
"""
    run = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True, timeout=60)
    assert run.returncode == 0, run.stderr
