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

WITHOUT_POSIX_AND_ROS = """
import os
import sys

import numba  # of other machines, it has a wheel of its own

for name in ('fcntl', 'resource', 'pwd', 'grp', 'termios', 'rclpy'):
    sys.modules[name] = None  # importing it fails
for name in ('O_CLOEXEC', 'O_NONBLOCK', 'O_DIRECTORY'):
    delattr(os, name)
"""

REWRITE_AND_DEMO = """
from pathlib import Path
from mlmem.element_file import load_element, write_element_file
from mlmem_tools.cli.main import main

for source in 'case_2', 'own.yaml':
    write_element_file(Path('own.yaml'), load_element(source))
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


def test_machine_without_posix_and_ros_runs_library_and_demo(tmp_path):
    program = WITHOUT_POSIX_AND_ROS + SIMULATE + REWRITE_AND_DEMO
    positions, demo = run_program(program, folder=tmp_path).split('\n', 1)
    assert json.loads(positions)[-1] == pytest.approx([100.0], abs=0.01)
    written = mlmem.load_element(tmp_path / 'own.yaml')
    assert written.design_and_settings == mlmem.load_element('case_2').design_and_settings
    rows = json.loads(demo)['levels']
    assert [row['decoded'] for row in rows] == [row['asked'] for row in rows]
    assert {row['asked'] for row in rows} == set(range(8))


def test_simulate_without_compiler_gives_compiled_positions():
    """They differ by rounding alone: a product is rounded where the compiled loop fuses it."""
    element = mlmem.load_element('case_2')
    compiled = mlmem.simulate(
        element.design, initial=mlmem.wall_at(level=3), duration=2, save_every=1
    )
    positions = json.loads(run_program(SIMULATE, NUMBA_DISABLE_JIT='1'))
    assert positions == pytest.approx(compiled.wall_positions, abs=1e-9)
