# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Real time: one thread that runs ticks, and the queue of its requests."""
