# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The contract's quality of service as rclpy profiles."""

from rclpy.duration import Duration
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
)

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

ALIVE = 'alive'
"""A topic of the node, below its name, on which nothing is published: the middleware says on its
own, once in every lease, that the publisher lives, however busy the node's threads are.
"""

CLIENTS = 'clients'
"""Such a topic of the clients, from which the node learns who lives: a killed process says no
goodbye, that of others may be lost, and the graph forgets them only after 20 s.
"""

HEARD = 1.0
"""Seconds within which both sides hear that the other lives; the middleware sees to it."""


def heard_within(seconds: float) -> QoSProfile:
    """Return the profile of `ALIVE` and `CLIENTS`: of a publisher that is heard as often as this,
    or of a subscription that expects it.
    """
    return QoSProfile(
        depth=1,
        liveliness=LivelinessPolicy.AUTOMATIC,
        liveliness_lease_duration=Duration(seconds=seconds),
    )
