# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Shmoo maps: the settings for which a memory works, and how far its own are from failure."""

from .distance import Margins, draw_map, measure_margins
from .shmoo import Shmoo, make_axis, prepare_settings, rerun_point

__all__ = [
    'Margins',
    'Shmoo',
    'draw_map',
    'make_axis',
    'measure_margins',
    'prepare_settings',
    'rerun_point',
]
