# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A ROS graph for these tests alone."""

import importlib.util
import sys
from pathlib import Path

import pytest

collect_ignore = []
if importlib.util.find_spec('rclpy') is None:
    collect_ignore.append('test_gait_store.py')
sys.path.append(str(Path(__file__).parents[1]))  # without a build


@pytest.fixture(scope='session', autouse=True)
def own_graph():
    """Keep these tests out of other ROS graphs."""
    from mlmem_ros.testing import isolate

    isolate()
