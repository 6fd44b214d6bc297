# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The energy of a wall over its position, and the wall as a particle that rolls in it."""
