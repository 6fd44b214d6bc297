# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The material: arrays in, arrays out. It knows no device, no ROS, no files and no clock."""

from typing import Any

from .cases import CASE_I, CASE_II
from .chain import Chain, Drive
from .design import Design
from .errors import DesignError, StateError
from .integrator import Integrator
from .noh_bathe import NOH_BATHE
from .pefrl import PEFRL
from .specimen import Scatter, Specimen, scattered
from .stepping import INTEGRATORS, default_step, kernel_in_cache, stable_step, substep_times
from .wall import Wall, level_of, walls

__all__ = [
    'CASE_I',
    'CASE_II',
    'INTEGRATORS',
    'NOH_BATHE',
    'PEFRL',
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
    'scattered',
    'stable_step',
    'substep_times',
    'walls',
]


def __getattr__(name: str) -> Any:
    """Return a name of 0.1, for one release: presets are the device's now, with settings."""
    if name not in ('PRESETS', 'preset'):
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    import warnings
    from importlib import import_module  # and not above: the material knows no device

    presets = import_module('mlmem_ros.device.presets')
    warnings.warn(
        f'mlmem_ros.physics.{name} has moved: take mlmem_ros.device.{name}, whose presets have '
        'a design and settings',
        DeprecationWarning,
        stacklevel=2,
    )
    if name == 'preset':
        return lambda preset: presets.preset(preset).design
    return {key: known.design for key, known in presets.PRESETS.items()}
