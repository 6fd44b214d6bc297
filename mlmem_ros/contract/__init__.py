# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The public ROS interface: topics, requests, answers; for node, clients and sessions.

`topics` and `commands` need no ROS; `requests` and `answers` no device.
Nothing here holds state or depends on a node.
"""
