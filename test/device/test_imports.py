# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Imports run one way: the device knows the material, and numpy and numba are all it needs."""

import ast
import subprocess
import sys
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

import mlmem_ros
from mlmem_ros.physics import wall

WALL = wall.__name__
ROOT = Path(mlmem_ros.__file__).parent
SOURCES = sorted((ROOT / 'device').rglob('*.py'))
BELOW = ('chance', 'clipped', 'described', 'device', 'durable', 'physics', 'threads', 'words')
"""What the device may import, all of it in the package."""


def imported(source):
    """Return what a file imports from the package, relative imports written out."""
    package = ['mlmem_ros', *source.relative_to(ROOT).parent.parts]
    found = set()
    for node in ast.walk(ast.parse(source.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            above = package[: len(package) + 1 - node.level] if node.level else []
            module = '.'.join([*above, *filter(None, [node.module])])
            found |= {f'{module}.{alias.name}' for alias in node.names}
    return {name.removeprefix('mlmem_ros.') for name in found if name.startswith('mlmem_ros.')}


@pytest.mark.parametrize('source', SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_the_device_knows_the_material_and_nothing_above(source):
    assert not [name for name in imported(source) if name.partition('.')[0] not in BELOW]


@pytest.mark.parametrize('source', SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_no_part_of_the_device_finds_walls(source):
    """Neither the module that finds them nor a name from it; see also test_procedures."""
    found = {name for name in vars(wall) if getattr(vars(wall)[name], '__module__', '') == WALL}
    assert found >= {'walls', 'level_of', 'Wall'}
    names = imported(source)
    assert not {name.rpartition('.')[2] for name in names} & found
    assert not [name for name in names if f'mlmem_ros.{name}.'.startswith(f'{WALL}.')]


def test_no_file_of_the_device_or_the_analysis_imports_itself_by_a_detour():
    """Not even for type checkers alone; a package's `__init__` counts as those that import it."""
    files = [*SOURCES, *(ROOT / 'analysis').rglob('*.py')]
    names = {'.'.join(f.relative_to(ROOT).with_suffix('').parts): f for f in files}
    graph = {
        name: {n for found in imported(f) for n in (found, found.rpartition('.')[0]) if n in names}
        for name, f in names.items()
    }
    TopologicalSorter(graph).prepare()  # raises CycleError


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
