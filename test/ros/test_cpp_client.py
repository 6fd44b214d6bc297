# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The C++ client of the examples is built, where rclcpp is, and writes and reads a level."""

import subprocess
from pathlib import Path

import pytest
from cpp import built

from mlmem_ros.contract import services

EXAMPLE = Path(__file__).parents[2] / 'examples' / 'cpp_client'


@pytest.fixture(scope='module')
def program(tmp_path_factory):
    if not services.load_action_types():
        pytest.skip('mlmem_interfaces is not built: make interfaces')
    return built(EXAMPLE, tmp_path_factory.mktemp('cpp_client'), 'rclcpp_action') / 'client'


def test_cpp_client_writes_and_reads_a_level(program, start):
    start()
    done = subprocess.run([program, '3'], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert 'level 3' in done.stderr
