# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a topic is: name, type and quality of service; and what a DiagnosticStatus says.

The topics themselves stand in two tables: `streams.STREAMS` has those that a node publishes,
`commands.COMMAND_TOPICS` those that it subscribes to.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from enum import Enum
from functools import cache, cached_property
from importlib import import_module
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from rclpy.qos import QoSProfile


class Qos(Enum):
    """Qualities of service, in ROS terms.

    Attributes:
        depth: How many messages are kept for a slow subscriber; 0: all.
        reliability: reliable or best_effort.
        durability: volatile or transient_local.
    """

    SENSOR_DATA = 5, 'best_effort', 'volatile'
    """For subscribers to a stream of which only the newest sample matters."""

    STREAM = 5, 'reliable', 'volatile'
    """For the streams we publish: shallow, and reliable, so that every subscriber matches."""

    RELIABLE = 10, 'reliable', 'volatile'
    """Every message counts, for subscribers."""

    LATCHED = 1, 'reliable', 'transient_local'
    """Late subscribers get the last message."""

    KEEP_ALL = 0, 'reliable', 'volatile'
    """For requests and their answers: with rclpy's default, more than ten at once lose some."""

    HEARTBEAT = 1, 'best_effort', 'volatile'
    """For signs of life, of which the last says all."""

    def __init__(self, depth: int, reliability: str, durability: str) -> None:
        self.depth = depth
        self.reliability = reliability
        self.durability = durability

    @property
    def profile(self) -> QoSProfile:
        """A new profile of rclpy, which may change it by `qos_overrides.*`."""
        from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

        history = {'depth': self.depth} if self.depth else {'history': HistoryPolicy.KEEP_ALL}
        return QoSProfile(
            **history,
            reliability=ReliabilityPolicy[self.reliability.upper()],
            durability=DurabilityPolicy[self.durability.upper()],
        )


@dataclass(frozen=True)
class Topic:
    """A topic.

    Attributes:
        name: Below the node's name.
        type: Type of its messages.
        qos: QoS of the node's publisher or subscription.
        meaning: What a message means, for the reference page.
    """

    name: str
    type: str
    qos: Qos
    meaning: str

    @cached_property
    def kind(self) -> Any:
        """The class of its messages, from ROS."""
        return load_interface(self.type)


@cache
def load_interface(name: str) -> Any:
    """Return the class of a type of ROS, given as `std_msgs/msg/String`."""
    package, folder, kind = name.split('/')
    return getattr(import_module(f'{package}.{folder}'), kind)


def load_installed(types: Mapping[str, str]) -> dict[str, Any]:
    """Return the classes of types of ROS by name; only of those that are installed."""
    found = {}
    for name, type_name in types.items():
        with suppress(ImportError, AttributeError):
            found[name] = load_interface(type_name)
    return found


DIAGNOSTICS_TOPIC = Topic(
    '/diagnostics',
    'diagnostic_msgs/msg/DiagnosticArray',
    Qos.RELIABLE,
    'health of loop, material, actuator, transducers, memory, faults and recorder, once a second; '
    'of the twin, from `memory_monitor`',
)
"""The one topic that all nodes share."""

OK, WARN, ERROR = range(3)
"""Levels of diagnostic_msgs/msg/DiagnosticStatus."""


class Status(NamedTuple):
    """The values of a DiagnosticStatus.

    Attributes:
        severity: `OK`, `WARN` or `ERROR`; an aggregator decides when a status is stale.
        text: In a few words.
        values: By name. A message has them as texts; see `answers.format_values`.
    """

    severity: int
    text: str
    values: Mapping[str, Any] = MappingProxyType({})


def parse_status(message: Any) -> Status:
    """Return the values of a DiagnosticStatus, from rclpy or from a bag."""
    severity = message.level[0] if isinstance(message.level, bytes) else int(message.level)
    pairs = {pair.key: pair.value for pair in message.values}
    return Status(severity, message.message, pairs)
