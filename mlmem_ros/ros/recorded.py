# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What of a node goes into a session: its topics with their types, and its parameters."""

from __future__ import annotations

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from ..bag.qos import QosProfile
from ..host import SessionPlan
from ..host.settings import RecordSettings
from .inlets import Inlets
from .outlets import Outlets


def session_plan(node: Node, settings: RecordSettings | None = None) -> SessionPlan:
    """Return what a session of a node shall hold.

    Args:
        node: A memory node.
        settings: Where and how; by default by its parameters at this moment.

    Raises:
        SettingsError: The parameters are out of range together.
    """
    if settings is None:
        values = node.get_parameters_by_prefix('record')
        settings = RecordSettings(**{name: item.value for name, item in values.items()})
    topics = [*Inlets.TOPICS, *Outlets.TOPICS, *(Outlets.VIEWS if settings.views else ())]
    given = node.get_parameters_by_prefix('')
    return SessionPlan(
        node.get_fully_qualified_name(),
        settings,
        [
            (node.resolve_topic_name(topic), _type_name(kind), _offered(qos))
            for topic, kind, qos in topics
        ],
        {name: parameter.value for name, parameter in given.items()},
    )


def _type_name(kind: type) -> str:
    package = kind.__module__.split('.')[0]
    return f'{package}/msg/{kind.__name__}'


def _offered(qos: QoSProfile) -> QosProfile:
    reliable = qos.reliability == ReliabilityPolicy.RELIABLE
    latched = qos.durability == DurabilityPolicy.TRANSIENT_LOCAL
    return QosProfile(
        reliability='reliable' if reliable else 'best_effort',
        durability='transient_local' if latched else 'volatile',
    )
