# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ways to move a wall, their settings, and the fastest route from level to level."""
