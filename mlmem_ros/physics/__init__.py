# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The material: arrays in, arrays out. It knows no device, no ROS, no files and no clock."""

from .chain import Chain, Drive, kernel_in_cache, stable_step, substep_times
from .design import Design
from .errors import DesignError, StateError
from .presets import CASE_I, CASE_II, PRESETS, preset
from .specimen import Scatter, Specimen, scattered
from .wall import Wall, walls

__all__ = [
    'CASE_I',
    'CASE_II',
    'PRESETS',
    'Chain',
    'Design',
    'DesignError',
    'Drive',
    'Scatter',
    'Specimen',
    'StateError',
    'Wall',
    'kernel_in_cache',
    'preset',
    'scattered',
    'stable_step',
    'substep_times',
    'walls',
]
