# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Tolerance: how often writes and reads fail when elements are not made as designed."""
