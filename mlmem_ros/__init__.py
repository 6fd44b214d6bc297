# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Mechanical multi-level memory for robots: material, device, sessions and ROS 2 node."""

__version__ = '0.1.0'
