# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The memory element as an instrument: it uses the material, but neither ROS nor the true wall."""

from ..procedures import (
    BLANK,
    UNDECODABLE,
    Abort,
    Calibrate,
    Erase,
    Locate,
    Read,
    Reset,
    SelfTest,
    Survey,
    Write,
    describe_level,
)
from .calibration import Calibration, DelayTable
from .commands import (
    Command,
    Disturb,
    EchoReceived,
    Event,
    FollowTrajectory,
    Inject,
    Outcome,
    SetFaults,
    SetMethod,
    SetStrain,
)
from .drivers import Driver
from .element import MemoryElement, new_element
from .end import End, Shot
from .errors import DriverError, DriverHangs, ProcedureFailed, Refused, SettingsError
from .factory import factory_calibration
from .faults import Faults
from .loop import Loop
from .presets import PRESETS, Preset, preset
from .reading import Reading, Unknown
from .settings import Settings

__all__ = [
    'BLANK', 'PRESETS', 'UNDECODABLE', 'Abort', 'Calibrate', 'Calibration', 'Command',
    'DelayTable', 'Disturb', 'Driver', 'DriverError', 'DriverHangs', 'EchoReceived', 'End',
    'Erase', 'Event', 'Faults', 'FollowTrajectory', 'Inject', 'Locate', 'Loop', 'MemoryElement',
    'Outcome', 'Preset', 'ProcedureFailed', 'Read', 'Reading', 'Refused', 'Reset', 'SelfTest',
    'SetFaults', 'SetMethod', 'SetStrain', 'Settings', 'SettingsError', 'Shot', 'Survey',
    'Unknown', 'Write', 'describe_level', 'factory_calibration', 'new_element', 'preset',
]  # fmt: skip
