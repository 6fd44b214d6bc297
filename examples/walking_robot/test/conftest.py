# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A ROS graph for these tests alone; they need MuJoCo."""

import importlib.util
import sys
from pathlib import Path

import pytest

collect_ignore = []
if not all(importlib.util.find_spec(each) for each in ('rclpy', 'mujoco')):
    collect_ignore.append('test_walking_robot.py')
sys.path.append(str(Path(__file__).parents[1]))


@pytest.fixture(scope='session', autouse=True)
def own_graph():
    """Keep these tests out of other ROS graphs."""
    from mlmem_ros.testing import isolate

    isolate()
