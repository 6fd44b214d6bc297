# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The latest message of each topic of a running node, for display."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mlmem_ros.contract import calls, topics
from mlmem_ros.ros.client.client import MemoryClient
from mlmem_ros.ros.middleware import SENSOR_DATA, profile

WANTED = ('design.N', 'design.J', 'scale.length', 'actuator.max_strain', 'probe.gain_decay')
"""Parameters needed to display messages."""


@dataclass(frozen=True)
class Status:
    """A component's health or a procedure's end."""

    severity: int
    text: str
    values: Mapping[str, str]

    @classmethod
    def of(cls, message: Any) -> Status:
        """Return the status in a message."""
        return cls(message.level[0], message.message, calls.values_of(message))


@dataclass
class View:
    """The latest state received from an element; None stands for what has not come yet.

    Attributes:
        name: Full name of the node.
        period: Cells from one level to the next.
        max_strain: Largest strain of the actuator.
        level: Level that was decoded last, or -2 if it is not known any more.
        content: The same in words: why it is not known, and since when.
        walls: True wall positions in sites.
        strain: Substrate strain, tension positive.
        echo: v_c of the last echo in cells over time, compensated for damping.
        health: Status of every component, by its name.
        last_message: When the last message came, on the clock of `time.monotonic`.
    """

    name: str
    cells: int
    period: int
    max_strain: float
    level: int | None = None
    content: Status | None = None
    walls: list[float] | None = None
    strain: float | None = None
    echo: list[float] | None = None
    outcome: Status | None = None
    health: dict[str, Status] = field(default_factory=dict)
    last_message: float = field(default_factory=time.monotonic)

    @property
    def silence(self) -> float:
        """Seconds since the last message."""
        return time.monotonic() - self.last_message


def components(message: Any, node: str) -> dict[str, Status]:
    """Return the status of every component of a node in a DiagnosticArray, by its name."""
    prefix = f'{node[1:]}: '
    return {
        status.name.removeprefix(prefix): Status.of(status)
        for status in message.status
        if status.name.startswith(prefix)
    }


def listen(client: MemoryClient, topic: topics.Topic, take: Callable[[Any], None]) -> Any:
    """Subscribe to a topic of a client's memory node, of a stream to the newest message; `take` is
    called in the thread that spins the client's node.
    """
    name = topic.name if topic.name[0] == '/' else f'{client.name}/{topic.name}'
    qos = SENSOR_DATA if topic.qos == topics.STREAM else profile(topic.qos)
    return client.node.create_subscription(topic.kind, name, take, qos)


class Monitor:
    """Listens to a node."""

    def __init__(self, client: MemoryClient, parameters: Mapping[str, Any]) -> None:
        """Subscribe to the topics of a client's node, given its parameters, at least those in
        `WANTED`.
        """
        self.view = View(
            client.name,
            cells=parameters['design.N'],
            period=parameters['design.J'],
            max_strain=parameters['actuator.max_strain'],
        )
        self._length = parameters['design.N'] * parameters['scale.length']
        self._gain_decay = parameters['probe.gain_decay']
        for topic, take in (
            (topics.LEVEL, self._on_level),
            (topics.CONTENT, self._on_content),
            (topics.OUTCOME, self._on_outcome),
            (topics.ECHO, self._on_echo),
            (topics.WALL, self._on_wall),
            (topics.JOINT_STATES, self._on_joint_states),
            (topics.DIAGNOSTICS, self._on_diagnostics),
        ):
            listen(client, topic, take)

    def _on_level(self, message: Any) -> None:
        self.view.level = message.data

    def _on_content(self, message: Any) -> None:
        self.view.content = Status.of(message)

    def _on_outcome(self, message: Any) -> None:
        self.view.outcome = Status.of(message)

    def _on_echo(self, message: Any) -> None:
        t, _, v_c = calls.echo(message)
        self.view.echo = (v_c * np.exp(self._gain_decay * t)).tolist()

    def _on_wall(self, message: Any) -> None:
        self.view.walls = list(message.data)
        self.view.last_message = time.monotonic()

    def _on_joint_states(self, message: Any) -> None:
        self.view.strain = calls.displacement(message) / self._length
        self.view.last_message = time.monotonic()

    def _on_diagnostics(self, message: Any) -> None:
        if found := components(message, self.view.name):
            self.view.health |= found
            self.view.last_message = time.monotonic()
