# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The ROS 2 side: node, parameters, messages and client. Thin: the device does the work."""
