# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a session records of a node: its topics with their types, and its parameters."""

from __future__ import annotations

from dataclasses import replace

from rclpy.node import Node

from ...contract import topics
from ...device import drivers
from ...host import SessionPlan
from ...host.settings import Parameters


def session_plan(node: Node, given: Parameters, path: str = '') -> SessionPlan:
    """Return what a session of a node records as its parameters say; a path takes the place of
    theirs.
    """
    settings = replace(given.record, path=path) if path else given.record
    published = topics.STREAMS + (topics.VIEWS if settings.views else ())
    if given.device.driver != drivers.SIMULATION:
        published = tuple(topic for topic in published if topic not in topics.OF_A_SIMULATION)
    return SessionPlan(
        node.get_fully_qualified_name(),
        settings,
        [
            topic._replace(name=node.resolve_topic_name(f'~/{topic.name}'))
            for topic in (*topics.COMMANDS, *published)
        ],
        {name: node.get_parameter(name).value for name in node.list_parameters([], 0).names},
        given.files,
    )
