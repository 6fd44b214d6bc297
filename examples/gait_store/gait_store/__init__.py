# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A robot that keeps its gait in a mechanical memory, and nowhere else."""
