# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The material: arrays in, arrays out. No device, no ROS, no files, no clock."""

from ..errors import DesignError, StateError
from .chain import Chain, find_cache_folder, is_kernel_cached
from .design import CASE_I, CASE_II, Design, as_design
from .jit import ARITHMETIC_VERSION
from .pefrl import SUBSTEPS_PER_STEP
from .potential import Potential
from .specimen import Material, Scatter, Specimen, as_specimen, draw_specimen
from .stepping import HeldCell, default_step, stable_step, substep_times
from .wall import Wall, find_level, find_walls, wall_energy

__all__ = [
    'ARITHMETIC_VERSION',
    'CASE_I',
    'CASE_II',
    'SUBSTEPS_PER_STEP',
    'Chain',
    'Design',
    'DesignError',
    'HeldCell',
    'Material',
    'Potential',
    'Scatter',
    'Specimen',
    'StateError',
    'Wall',
    'as_design',
    'as_specimen',
    'default_step',
    'draw_specimen',
    'find_cache_folder',
    'find_level',
    'find_walls',
    'is_kernel_cached',
    'stable_step',
    'substep_times',
    'wall_energy',
]  # fmt: skip
