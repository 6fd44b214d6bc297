# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The quality of service of our topics, by name."""

from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    QoSProfile,
    ReliabilityPolicy,
    qos_profile_sensor_data,
)

SENSOR_DATA = qos_profile_sensor_data
"""Best effort, keep the last 5: for who listens to a stream of which only the newest matters."""

STREAM = QoSProfile(depth=5, reliability=ReliabilityPolicy.RELIABLE)
"""What our streams are offered with: shallow, and reliable, so that every subscriber hears them,
a plain one and a default display too; who wants best effort gets it."""

RELIABLE = QoSProfile(depth=10, reliability=ReliabilityPolicy.RELIABLE)
"""Reliable and volatile: every message counts, for those who listen."""

LATCHED = QoSProfile(
    depth=1,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
"""Reliable and transient local: who comes late gets the last one."""

EVERY_ONE = QoSProfile(history=HistoryPolicy.KEEP_ALL, reliability=ReliabilityPolicy.RELIABLE)
"""Of requests and their answers: with rclpy's default, who has more than ten under way at once
loses some."""
