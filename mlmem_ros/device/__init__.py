# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The memory element as an instrument: it uses the material, but neither ROS nor the true wall."""

from ..words import BLANK, UNDECODABLE, describe_level
from .calibration import Calibration, DelayTable
from .commands import (
    Abort,
    Calibrate,
    Command,
    Disturb,
    Erase,
    FollowTrajectory,
    Read,
    SelfTest,
    SetFaults,
    SetStrain,
    Write,
)
from .driver import Driver
from .element import MemoryElement
from .end import End
from .errors import DriverError, ProcedureFailed, Refused, SettingsError
from .events import Event, Heard, Outcome
from .factory import factory_calibration, new_element
from .faults import Faults
from .loop import Loop
from .presets import PRESETS, Preset, preset
from .reading import Reading
from .settings import Settings

__all__ = [
    'BLANK',
    'PRESETS',
    'UNDECODABLE',
    'Abort',
    'Calibrate',
    'Calibration',
    'Command',
    'DelayTable',
    'Disturb',
    'Driver',
    'DriverError',
    'End',
    'Erase',
    'Event',
    'Faults',
    'FollowTrajectory',
    'Heard',
    'Loop',
    'MemoryElement',
    'Outcome',
    'Preset',
    'ProcedureFailed',
    'Read',
    'Reading',
    'Refused',
    'SelfTest',
    'SetFaults',
    'SetStrain',
    'Settings',
    'SettingsError',
    'Write',
    'describe_level',
    'factory_calibration',
    'new_element',
    'preset',
]
