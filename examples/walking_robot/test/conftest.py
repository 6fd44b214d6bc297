# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A ROS graph for these tests alone; they need MuJoCo."""

import importlib.util
import sys
from pathlib import Path

if all(importlib.util.find_spec(each) for each in ('rclpy', 'mujoco')):
    from mlmem_ros.testing import isolate

    isolate()
else:
    collect_ignore = ['test_walking_robot.py']
sys.path.append(str(Path(__file__).parents[1]))
