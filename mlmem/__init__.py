# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Mechanical multi-level memory as a library: the material, an element and its real-time loop.

It needs numpy, numba and PyYAML, no ROS. Names are imported on first use.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .commands import (
        Command,
        Disturb,
        EchoReceived,
        Event,
        FollowTrajectory,
        Outcome,
        SetFaults,
        SetMethod,
        SetStrain,
    )
    from .element import MemoryElement
    from .element_file import ELEMENT_NAMES, Element, as_designed, load_element
    from .errors import DriverError, DriverHangs, ProcedureFailed, Refused, SettingsError
    from .factory import factory_calibration
    from .instrument.drivers import Driver
    from .instrument.end import End, Shot
    from .instrument.faults import Faults
    from .loop.loop import Loop
    from .parameter_sweep import Table, sweep
    from .physics import (
        CASE_I,
        CASE_II,
        Chain,
        Design,
        DesignError,
        Potential,
        Scatter,
        Specimen,
        StateError,
        draw_specimen,
    )
    from .procedure_table import (
        BLANK,
        UNDECODABLE,
        Abort,
        Calibrate,
        Erase,
        Kick,
        Locate,
        Read,
        Reset,
        SelfTest,
        Survey,
        Write,
        describe_level,
    )
    from .readers.calibration import Calibration, DelayTable
    from .readers.reading import Reading, Unknown
    from .settings import Settings
    from .simulation import Trajectory, simulate, wall_at, walls_at

__all__ = [
    'BLANK', 'CASE_I', 'CASE_II', 'ELEMENT_NAMES', 'UNDECODABLE', 'Abort', 'Calibrate',
    'Calibration', 'Chain', 'Command', 'DelayTable', 'Design', 'DesignError', 'Disturb', 'Driver',
    'DriverError', 'DriverHangs', 'EchoReceived', 'Element', 'End', 'Erase', 'Event', 'Faults',
    'FollowTrajectory', 'Kick', 'Locate', 'Loop', 'MemoryElement', 'Outcome', 'Potential',
    'ProcedureFailed', 'Read', 'Reading', 'Refused', 'Reset', 'Scatter', 'SelfTest', 'SetFaults',
    'SetMethod', 'SetStrain', 'Settings', 'SettingsError', 'Shot', 'Specimen', 'StateError',
    'Survey', 'Table', 'Trajectory', 'Unknown', 'Write', 'as_designed', 'describe_level',
    'draw_specimen', 'factory_calibration', 'load_element', 'simulate', 'sweep', 'wall_at',
    'walls_at',
]  # fmt: skip

_MODULE_EXPORTS = {
    'commands': (
        'Command', 'Disturb', 'EchoReceived', 'Event', 'FollowTrajectory', 'Outcome',
        'SetFaults', 'SetMethod', 'SetStrain',
    ),
    'element': ('MemoryElement',),
    'errors': ('DriverError', 'DriverHangs', 'ProcedureFailed', 'Refused', 'SettingsError'),
    'factory': ('factory_calibration',),
    'instrument.drivers': ('Driver',),
    'instrument.end': ('End', 'Shot'),
    'instrument.faults': ('Faults',),
    'loop.loop': ('Loop',),
    'parameter_sweep': ('Table', 'sweep'),
    'physics': (
        'CASE_I', 'CASE_II', 'Chain', 'Design', 'DesignError', 'Potential', 'Scatter', 'Specimen',
        'StateError', 'draw_specimen',
    ),
    'element_file': ('ELEMENT_NAMES', 'Element', 'as_designed', 'load_element'),
    'procedure_table': (
        'BLANK', 'UNDECODABLE', 'Abort', 'Calibrate', 'Erase', 'Kick', 'Locate', 'Read',
        'Reset', 'SelfTest', 'Survey', 'Write', 'describe_level',
    ),
    'readers.calibration': ('Calibration', 'DelayTable'),
    'readers.reading': ('Reading', 'Unknown'),
    'settings': ('Settings',),
    'simulation': ('Trajectory', 'simulate', 'wall_at', 'walls_at'),
}  # fmt: skip
"""Modules, and the public names that they define."""


def __getattr__(name: str) -> Any:
    for module, names in _MODULE_EXPORTS.items():
        if name in names:
            return getattr(import_module(f'.{module}', __name__), name)
    raise AttributeError(f'module {__name__!r} has no attribute {name!r}')


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
