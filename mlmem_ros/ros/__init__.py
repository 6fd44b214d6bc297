# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The ROS 2 side of the contract: the node, its clients and its views. No physics here."""
