# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The node: life cycle, parameters, what comes in and goes out. The device does the work."""
