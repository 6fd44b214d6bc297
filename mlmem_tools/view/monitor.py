# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How the page subscribes to the topics of a node, and parses health reports."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from mlmem_ros.contract.statuses import Status, parse_status
from mlmem_ros.contract.topics import STREAM_QOS, Topic
from mlmem_ros.ros.client.client import MemoryClient
from mlmem_ros.ros.middleware import SENSOR_DATA_PROFILE, build_qos_profile


def parse_components(message: Any, node: str) -> dict[str, Status]:
    """Return the status of every component of a node in a DiagnosticArray, by its name."""
    prefix = f'{node[1:]}: '
    return {
        status.name.removeprefix(prefix): parse_status(status)
        for status in message.status
        if status.name.startswith(prefix)
    }


def subscribe_topic(client: MemoryClient, topic: Topic, take: Callable[[Any], None]) -> Any:
    """Subscribe to a topic of a client's memory node, of a stream to the newest message; `take` is
    called in the thread that spins the client's node.
    """
    name = topic.name if topic.name[0] == '/' else f'{client.name}/{topic.name}'
    qos = SENSOR_DATA_PROFILE if topic.qos == STREAM_QOS else build_qos_profile(topic.qos)
    return client.node.create_subscription(topic.kind, name, take, qos)
