# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The C++ client of the examples is built where ROS 2 from apt is, and writes a level."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from mlmem_ros.contract import services

EXAMPLE = Path(__file__).parents[2] / 'examples' / 'cpp_client'
PREFIXES = os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep)


def test_cpp_client_writes_and_reads_a_level(start, tmp_path):
    if not services.load_action_types():
        pytest.skip('mlmem_interfaces is not built: make interfaces')
    if not any(Path(each, 'share', 'rclcpp_action').is_dir() for each in PREFIXES if each):
        pytest.skip('there is no rclcpp_action: wheels do not have it, apt does')
    if shutil.which('cmake') is None or shutil.which('c++') is None:
        pytest.skip('there is no cmake or no C++ compiler')
    subprocess.run(['cmake', '-S', EXAMPLE, '-B', tmp_path], check=True)
    subprocess.run(['cmake', '--build', tmp_path], check=True)
    start()
    client = [tmp_path / 'client', '3']
    done = subprocess.run(client, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    assert 'level 3' in done.stderr
