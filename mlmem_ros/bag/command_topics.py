# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The node's command topics: what a message on each asks of the device, live or from a bag."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from ..device import Command, Disturb, Read, SetStrain, Write
from ..device.units import Units
from .trajectory import command_of

Make = Callable[[Any, Units], Command]
"""Returns the command that a message is, its SI values in the device's units; or `Refused`."""


def _disturb(message: Any, units: Units) -> Disturb:
    """Return what an Imu message says of the base, along the chain.

    An Imu that has no accelerometer says so by its covariance (REP 145): it tells NaN, which
    the device refuses.
    """
    if message.linear_acceleration_covariance[0] == -1.0:
        return Disturb(math.nan)
    return Disturb(float(message.linear_acceleration.x) / units.acceleration)


COMMAND_TOPICS: dict[str, tuple[str, Make]] = {
    'strain': ('std_msgs/msg/Float64', lambda message, _: SetStrain(float(message.data))),
    'strain_trajectory': (
        'trajectory_msgs/msg/JointTrajectory',
        lambda message, units: command_of(message, units.elongation),
    ),
    'probe': ('std_msgs/msg/Empty', lambda message, _: Read()),
    'write_level': ('std_msgs/msg/UInt8', lambda message, _: Write(int(message.data))),
    'disturbance': ('sensor_msgs/msg/Imu', _disturb),
}
"""Type of each topic below the node's name, and how its messages become commands."""
