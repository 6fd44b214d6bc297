# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The contract's quality of service as rclpy profiles."""

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from ..contract import topics


def profile(qos: topics.Qos) -> QoSProfile:
    """Return the rclpy profile of a quality of service."""
    history = {'depth': qos.depth} if qos.depth else {'history': HistoryPolicy.KEEP_ALL}
    return QoSProfile(
        **history,
        reliability=ReliabilityPolicy[qos.reliability.upper()],
        durability=DurabilityPolicy[qos.durability.upper()],
    )


SENSOR_DATA = profile(topics.SENSOR_DATA)
RELIABLE = profile(topics.RELIABLE)
LATCHED = profile(topics.LATCHED)
EVERY_ONE = profile(topics.EVERY_ONE)
