# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Bags in rosbag2's format: recorded safely, read tolerantly. Nothing here needs a ROS graph."""
