# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The library where something is missing: POSIX, ROS 2, or the compiler."""

import json
import os
import subprocess
import sys

import pytest

import mlmem

SIMULATE = """
import json
import mlmem

element = mlmem.load_element('case_2')
run = mlmem.simulate(element.design, initial=mlmem.wall_at(level=3), duration=2, save_every=1)
print(json.dumps(run.wall_positions.tolist()))
"""

REWRITE = """
from pathlib import Path
from mlmem.element_file import load_element, write_element_file

for source in 'case_2', 'own.yaml':
    write_element_file(Path('own.yaml'), load_element(source))
"""

WITHOUT_POSIX = """
import os
import sys

import numba  # of other machines, it has a wheel of its own

for name in ('fcntl', 'resource', 'pwd', 'grp', 'termios', 'rclpy'):
    sys.modules[name] = None  # importing it fails
for name in ('O_CLOEXEC', 'O_NONBLOCK', 'O_DIRECTORY'):
    delattr(os, name)
"""

DEMO_WITHOUT_ROS = """
import importlib.util
import sys

find_spec = importlib.util.find_spec
importlib.util.find_spec = lambda name, *more: None if name == 'rclpy' else find_spec(name, *more)
sys.modules['rclpy'] = None
from mlmem_tools.cli.main import main

sys.exit(main(['demo', '--json']))
"""


def run_program(text, folder=None, **environment):
    """Return what a Python program prints, in a process of its own."""
    return subprocess.run(
        [sys.executable, '-c', text],
        cwd=folder,
        env={**os.environ, **environment},
        capture_output=True, text=True, check=True, timeout=300,
    ).stdout  # fmt: skip


def test_simulate_without_posix_functions_runs():
    (position,) = json.loads(run_program(WITHOUT_POSIX + SIMULATE))[-1]
    assert position == pytest.approx(100.0, abs=0.01)


def test_element_without_posix_functions_is_written(tmp_path):
    run_program(WITHOUT_POSIX + REWRITE, folder=tmp_path)
    written = mlmem.load_element(tmp_path / 'own.yaml')
    assert written.design_and_settings == mlmem.load_element('case_2').design_and_settings


def test_simulate_without_compiler_gives_compiled_positions():
    """They differ by rounding alone: a product is rounded where the compiled loop fuses it."""
    element = mlmem.load_element('case_2')
    compiled = mlmem.simulate(
        element.design, initial=mlmem.wall_at(level=3), duration=2, save_every=1
    )
    positions = json.loads(run_program(SIMULATE, NUMBA_DISABLE_JIT='1'))
    assert positions == pytest.approx(compiled.wall_positions, abs=1e-9)


def test_demo_without_ros_writes_and_reads_every_level(tmp_path):
    rows = json.loads(run_program(DEMO_WITHOUT_ROS))['levels']
    assert [row['decoded'] for row in rows] == [row['asked'] for row in rows]
    assert {row['asked'] for row in rows} == set(range(8))
