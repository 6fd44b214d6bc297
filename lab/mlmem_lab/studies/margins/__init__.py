# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Shmoo maps: the settings for which a memory works, and how far its own are from failure."""

from .axes import make_axis
from .distance import Margins, measure
from .draw import draw
from .shmoo import Shmoo, prepared, rerun

__all__ = ['Margins', 'Shmoo', 'draw', 'make_axis', 'measure', 'prepared', 'rerun']
