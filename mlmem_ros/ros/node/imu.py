# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What an inlet needs of an Imu message, taken from its bytes.

A robot sends some hundred a second, and to build the whole message (37 numbers in nine objects)
costs ten times as much as the rest of its way into the device.
"""

from __future__ import annotations

import struct
from types import SimpleNamespace
from typing import Any

from rclpy.serialization import deserialize_message
from sensor_msgs.msg import Imu

LITTLE_ENDIAN = b'\x00\x01'
"""How CDR begins on nearly every machine: plain, little-endian."""

NUMBERS, ACCELERATION, COVARIANCE = 37, 25, 28
"""Numbers after the header; indices where linear acceleration and its covariance begin."""


def decoded(cdr: bytes) -> Any:
    """Return an Imu's linear acceleration along x and first covariance, under its own names.

    Raises:
        What the middleware raises if the bytes are not an Imu.
    """
    if cdr[:2] == LITTLE_ENDIAN and len(cdr) >= 16:
        header = 12 + struct.unpack_from('<I', cdr, 12)[0]  # stamp, and the name of the frame
        begin = 4 + (header + 7) // 8 * 8
        if len(cdr) >= begin + 8 * NUMBERS:
            x, covariance = (
                struct.unpack_from('<d', cdr, begin + 8 * place)[0]
                for place in (ACCELERATION, COVARIANCE)
            )
            return SimpleNamespace(
                linear_acceleration=SimpleNamespace(x=x),
                linear_acceleration_covariance=(covariance,),
            )
    return deserialize_message(cdr, Imu)
