# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The reporter: asks every component, and publishes what they say."""

from __future__ import annotations

import time

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.node import Node

from ....contract.messages import key_values
from ....device import Loop
from ....host import Host
from ..boundary import Boundary
from .actuator import ActuatorComponent
from .faults import FaultsComponent
from .health import OK, Component, Health, Hysteresis
from .loop import LoopComponent
from .material import MaterialComponent
from .memory import MemoryComponent
from .recorder import RecorderComponent
from .transducer import TransducerComponent

PERIOD = 1.0
"""Seconds between two reports."""


class Diagnostics:
    """Publishes one status for every component; a new one is added to the list here."""

    def __init__(self, node: Node, host: Host, boundary: Boundary) -> None:
        self._node = node
        self._host = host
        components: list[Component] = [
            LoopComponent(host),
            MaterialComponent(),
            ActuatorComponent(),
            TransducerComponent(),
            MemoryComponent(),
            FaultsComponent(),
            RecorderComponent(host),
        ]
        self._components = [(component, Hysteresis()) for component in components]
        self._publisher = node.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self._due = 0.0
        self._looking = False
        boundary.every(PERIOD, '/diagnostics', self._report)

    def tick(self, loop: Loop) -> None:
        """Let the components look at the device around one tick a period; called after each."""
        element = loop.element
        if self._looking:
            for component, _ in self._components:
                component.after_tick(element)
            self._looking = False
        elif (now := time.monotonic()) >= self._due:
            self._due = now + PERIOD
            for component, _ in self._components:
                component.before_tick(element)
            self._looking = True

    def _report(self) -> None:
        loop = self._host.loop
        status = []
        for component, hysteresis in self._components:
            if loop is None:
                hysteresis.forget()
            now = component.rest() if loop is None else component.health(loop)
            status.append(self._status(component.name, hysteresis.smooth(now)))
        self._publish(status)

    def announce(self, text: str) -> None:
        """Report what keeps the node from reporting by itself; from any thread."""
        self._publish([self._status(LoopComponent.name, Health(OK, text))])

    def _publish(self, status: list[DiagnosticStatus]) -> None:
        message = DiagnosticArray(status=status)
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(message)

    def _status(self, component: str, health: Health) -> DiagnosticStatus:
        return DiagnosticStatus(
            level=health.level,
            name=f'{self._node.get_fully_qualified_name()[1:]}: {component}',
            message=health.text,
            hardware_id=self._node.get_fully_qualified_name(),
            values=key_values(health.values),
        )
