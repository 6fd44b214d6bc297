# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The material: arrays in, arrays out. It knows no device, no ROS, no files and no clock."""

from .chain import Chain, Drive
from .design import Design
from .errors import DesignError, StateError
from .integrator import Integrator
from .noh_bathe import NOH_BATHE
from .pefrl import PEFRL
from .presets import CASE_I, CASE_II, PRESETS, preset
from .specimen import Scatter, Specimen, scattered
from .stepping import INTEGRATORS, default_step, kernel_in_cache, stable_step, substep_times
from .wall import Wall, level_of, walls

__all__ = [
    'CASE_I',
    'CASE_II',
    'INTEGRATORS',
    'NOH_BATHE',
    'PEFRL',
    'PRESETS',
    'Chain',
    'Design',
    'DesignError',
    'Drive',
    'Integrator',
    'Scatter',
    'Specimen',
    'StateError',
    'Wall',
    'default_step',
    'kernel_in_cache',
    'level_of',
    'preset',
    'scattered',
    'stable_step',
    'substep_times',
    'walls',
]
