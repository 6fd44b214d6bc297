# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The pages run in the ROS graph of test/ros."""

import importlib.util
import sys
from pathlib import Path

_path = Path(__file__).parent.parent / 'ros' / 'conftest.py'
_spec = importlib.util.spec_from_file_location('ros_conftest', _path)
_ros = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(_ros)

pytest_pycollect_makemodule = _ros.pytest_pycollect_makemodule
driver, start, start_shared = _ros.driver, _ros.start, _ros.start_shared

sys.path.append(str(Path(__file__).parent))  # page.py
