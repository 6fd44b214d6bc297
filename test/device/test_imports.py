# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Imports run one way, and the device needs only numpy and numba."""

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
COMMON = {'chance', 'clipped', 'described', 'durable', 'threads', 'verdict', 'words'}
"""Files of the package that know no layer."""

LAYERS = ('physics', 'device', 'analysis')
"""Each imports those before it, and no other folder of the package."""

FILES = [file for layer in LAYERS for file in sorted((ROOT / layer).rglob('*.py'))]
EVERY = pytest.mark.parametrize('source', FILES, ids=lambda path: str(path.relative_to(ROOT)))


def imported(source):
    """Return what a file imports from the package, with relative imports resolved."""
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


@EVERY
def test_a_layer_imports_those_below(source):
    own = LAYERS.index(source.relative_to(ROOT).parts[0])
    allowed = {*COMMON, *LAYERS[: own + 1]}
    assert {name.partition('.')[0] for name in imported(source)} <= allowed


@pytest.mark.parametrize('source', sorted((ROOT / 'device').rglob('*.py')), ids=lambda f: f.stem)
def test_no_part_of_the_device_finds_walls(source):
    """It imports neither the module that finds them nor a name of it; see also test_blindfold."""
    found = {name for name in vars(wall) if getattr(vars(wall)[name], '__module__', '') == WALL}
    assert found >= {'walls', 'level_of', 'Wall'}
    names = imported(source)
    assert not {name.rpartition('.')[2] for name in names} & found
    assert not [name for name in names if f'mlmem_ros.{name}.'.startswith(f'{WALL}.')]


def test_no_file_imports_itself_indirectly():
    """Not even for type checkers."""
    names = {'.'.join(f.relative_to(ROOT).with_suffix('').parts): f for f in FILES}
    graph = {
        name: {n for found in imported(f) for n in (found, found.rpartition('.')[0]) if n in names}
        for name, f in names.items()
    }
    TopologicalSorter(graph).prepare()  # raises CycleError


def test_the_device_can_be_imported_with_numpy_and_numba_alone():
    """All other dependencies of the package are hidden."""
    code = """
import sys
foreign = 'rclpy std_msgs yaml mcap rosbags scipy matplotlib rich'.split()
sys.modules.update(dict.fromkeys(foreign))
import mlmem_ros.device
"""
    run = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True, timeout=60)
    assert run.returncode == 0, run.stderr
