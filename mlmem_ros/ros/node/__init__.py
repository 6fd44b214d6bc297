# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The node: life cycle, parameters, inputs and outputs. The device does the work."""
