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
        COMMANDS_BY_NAME,
        Command,
        Disturb,
        EchoReceived,
        Event,
        Feedback,
        FollowTrajectory,
        Outcome,
        SetFaults,
        SetMethod,
        SetStrain,
    )
    from .element import MemoryElement
    from .element_file import ELEMENT_NAMES, Element, as_designed, load_element
    from .errors import (
        Checked,
        DriverError,
        DriverHangs,
        ErrorCode,
        ProcedureFailed,
        Refused,
        Rejected,
        SettingsError,
    )
    from .factory import compute_calibration, factory_calibration
    from .instrument.actuator import MAX_PROFILE_POINTS
    from .instrument.blocks import MAX_RUN_TICKS
    from .instrument.drivers import (
        SHIPPED_DRIVERS,
        SIMULATION_NAME,
        Driver,
        Simulation,
        open_driver,
        steps_per_tick,
    )
    from .instrument.end import End, Shot
    from .instrument.faults import Faults
    from .loop.loop import Loop
    from .loop.mailbox import Asked, Request, Stamped
    from .loop.timetable import MAX_SPEED, MIN_SPEED, Pacer, SteadyPacer, check_speed
    from .parameter_sweep import Table, sweep
    from .physics import (
        ARITHMETIC_VERSION,
        CASE_I,
        CASE_II,
        Chain,
        Design,
        DesignError,
        HeldCell,
        Potential,
        Scatter,
        Specimen,
        StateError,
        draw_specimen,
        find_cache_folder,
        is_kernel_cached,
    )
    from .physics.values import Array
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
    from .readers.calibration import Calibration, DelayTable, calibration_key
    from .readers.reading import Reading, Unknown
    from .readers.words import count_words
    from .settings import Settings
    from .simulation import Trajectory, simulate, wall_at, walls_at

__all__ = [
    'ARITHMETIC_VERSION', 'BLANK', 'CASE_I', 'CASE_II', 'COMMANDS_BY_NAME', 'ELEMENT_NAMES',
    'MAX_PROFILE_POINTS', 'MAX_RUN_TICKS', 'MAX_SPEED', 'MIN_SPEED', 'SHIPPED_DRIVERS',
    'SIMULATION_NAME', 'UNDECODABLE', 'Abort', 'Array', 'Asked', 'Calibrate', 'Calibration',
    'Chain', 'Checked', 'Command', 'DelayTable', 'Design', 'DesignError', 'Disturb', 'Driver',
    'DriverError', 'DriverHangs', 'EchoReceived', 'Element', 'End', 'Erase', 'ErrorCode', 'Event',
    'Faults', 'Feedback', 'FollowTrajectory', 'HeldCell', 'Kick', 'Locate', 'Loop',
    'MemoryElement', 'Outcome', 'Pacer', 'Potential', 'ProcedureFailed', 'Read', 'Reading',
    'Refused', 'Rejected', 'Request', 'Reset', 'Scatter', 'SelfTest', 'SetFaults', 'SetMethod',
    'SetStrain', 'Settings', 'SettingsError', 'Shot', 'Simulation', 'Specimen', 'Stamped',
    'StateError', 'SteadyPacer', 'Survey', 'Table', 'Trajectory', 'Unknown', 'Write',
    'as_designed', 'calibration_key', 'check_speed', 'compute_calibration', 'count_words',
    'describe_level', 'draw_specimen', 'factory_calibration', 'find_cache_folder',
    'is_kernel_cached', 'load_element', 'open_driver', 'simulate', 'steps_per_tick', 'sweep',
    'wall_at', 'walls_at',
]  # fmt: skip

_MODULES = (
    'errors', 'procedure_table', 'physics', 'physics.values', 'instrument.end',
    'instrument.faults', 'instrument.blocks', 'settings', 'readers.reading', 'readers.calibration',
    'readers.words', 'commands', 'instrument.actuator', 'instrument.drivers', 'element_file',
    'factory', 'element', 'loop.timetable', 'loop.mailbox', 'loop.loop', 'simulation',
    'parameter_sweep',
)  # fmt: skip
"""Modules with the public names, those first that need least."""


def __getattr__(name: str) -> Any:
    for module in _MODULES if name in __all__ else ():
        if hasattr(found := import_module(f'.{module}', __name__), name):
            globals()[name] = value = getattr(found, name)  # the next look-up finds it at once
            return value
    raise AttributeError(f'module {__name__!r} has no attribute {name!r}')


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
