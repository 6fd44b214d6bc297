# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a session records of a node: its topics with their types, and its parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

from rclpy.node import Node

from ...contract import topics
from ...device import drivers
from ...host import SessionPlan
from ...host.files import FileSettings
from ...host.settings import RecordSettings

T = TypeVar('T')


def session_plan(
    node: Node, settings: RecordSettings | None = None, path: str = ''
) -> SessionPlan:
    """Return what a session of a node records, by default as its parameters say; a path takes the
    place of theirs.

    Raises:
        SettingsError: The parameters contradict each other.
    """
    if settings is None:
        settings = _group(node, 'record', RecordSettings)
    if path:
        settings = replace(settings, path=path)
    published = topics.STREAMS + (topics.VIEWS if settings.views else ())
    if node.get_parameter('device.driver').value != drivers.SIMULATION:
        published = tuple(topic for topic in published if topic not in topics.OF_A_SIMULATION)
    return SessionPlan(
        node.get_fully_qualified_name(),
        settings,
        [
            topic._replace(name=node.resolve_topic_name(f'~/{topic.name}'))
            for topic in (*topics.COMMANDS, *published)
        ],
        {name: node.get_parameter(name).value for name in node.get_parameters_by_prefix('')},
        _group(node, 'files', FileSettings),
    )


def _group(node: Node, prefix: str, kind: Callable[..., T]) -> T:
    values = node.get_parameters_by_prefix(prefix)
    return kind(**{name: item.value for name, item in values.items()})
