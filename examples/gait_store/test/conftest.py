# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A ROS graph for these tests alone."""

import importlib.util
import sys
from pathlib import Path

if importlib.util.find_spec('rclpy') is None:
    collect_ignore = ['test_gait_store.py']
else:
    from mlmem_ros.testing import isolate

    isolate()
sys.path.append(str(Path(__file__).parents[1]))  # without a build
