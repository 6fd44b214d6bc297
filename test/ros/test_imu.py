# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Our fast decoder of an Imu gives what the middleware's gives."""

import struct

import pytest
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import Imu

from mlmem_ros.ros.node.topics import decode_imu


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


@pytest.mark.parametrize('kept', [200, 3, None], ids=['cut', 'no header', 'long name'])
def test_malformed_imu_fails_as_in_the_middleware(kept):
    cdr = serialize_message(Imu())
    bad = cdr[:kept] if kept else cdr[:12] + struct.pack('<I', 2**32 - 1) + cdr[16:]
    found = []
    for decode in (decode_imu, lambda cdr: deserialize_message(cdr, Imu)):
        try:
            found.append(repr(decode(bad)))
        except Exception as error:
            found.append(type(error))
    assert found[0] == found[1]
