# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Our fast decoder of an Imu gives what the middleware's gives."""

import struct

import pytest
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import Imu

from mlmem_ros.ros.node.topics import decode_imu

SHORT = Imu()
SHORT.linear_acceleration.x = 9.81


@pytest.mark.parametrize('length', range(17))
def test_imu_is_decoded_as_by_the_middleware(length):
    """For every length of the frame's name, which moves the numbers after it."""
    message = Imu()
    message.header.frame_id = 'f' * length
    message.header.stamp.nanosec = 123
    message.linear_acceleration.x = 1.0 + length
    message.linear_acceleration_covariance[0] = -1.0
    cdr = serialize_message(message)
    for found in (decode_imu(cdr), deserialize_message(cdr, Imu)):
        assert found.linear_acceleration.x == 1.0 + length
        assert found.linear_acceleration_covariance[0] == -1.0


def test_malformed_imu_fails_as_in_the_middleware():
    cdr = serialize_message(SHORT)
    for bad in (cdr[:200], cdr[:3], cdr[:12] + struct.pack('<I', 2**32 - 1) + cdr[16:]):
        try:
            expected = repr(deserialize_message(bad, Imu))
        except Exception as error:
            with pytest.raises(type(error)):
                decode_imu(bad)
        else:
            assert repr(decode_imu(bad)) == expected
