# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Shmoo maps: the settings for which a memory works, and how far its own are from failure."""

from .distance import Margins, draw, measure
from .shmoo import Shmoo, make_axis, prepared, rerun

__all__ = ['Margins', 'Shmoo', 'draw', 'make_axis', 'measure', 'prepared', 'rerun']
