# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Health on /diagnostics, once a second: loop, material and memory."""

from __future__ import annotations

import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.node import Node

from ..device import UNDECODABLE, Loop, describe_level
from ..physics import stable_step
from ..physics.energy import energy
from .messages import key_values
from .recording import Recording

PERIOD = 1.0
"""Seconds between two reports."""


class Diagnostics:
    """Reports one status for every component.

    The material's values are taken by `tick` in the loop's thread, where the state is whole.

    Attributes:
        recording: The session that is recorded, or None.
    """

    def __init__(self, node: Node, loop: Loop) -> None:
        self.recording: Recording | None = None
        self._node = node
        self._loop = loop
        self._publisher = node.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self._material: dict[str, Any] = {}
        self._next = 0.0
        self._last = (time.monotonic(), 0, 0)
        node.create_timer(PERIOD, self._report)

    def tick(self) -> None:
        """Take the material's values where they are due."""
        now = time.monotonic()
        if now < self._next:
            return
        self._next = now + PERIOD
        element = self._loop.element
        parts = energy(element.chain)
        self._material = {
            'stability_margin': 1.0 - element.chain.dt / stable_step(element.design),
            'dt': element.chain.dt,
            'strain': element.actuator.strain,
            'kinetic_energy': parts.kinetic,
            'stored_energy': parts.total - parts.kinetic,
        }

    def _report(self) -> None:
        message = DiagnosticArray(
            status=[
                self._loop_status(),
                self._material_status(),
                self._memory_status(),
                self._recorder_status(),
            ]
        )
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(message)

    def _status(self, component: str, level: bytes, text: str, values: dict[str, Any]) -> Any:
        name = f'{self._node.get_name()}: {component}'
        return DiagnosticStatus(level=level, name=name, message=text, values=key_values(values))

    def _loop_status(self) -> DiagnosticStatus:
        statistics = self._loop.statistics
        now, ticks, overruns = time.monotonic(), statistics.ticks, statistics.overruns
        then, ticks_then, overruns_then = self._last
        self._last = (now, ticks, overruns)
        values = {
            'rate': (ticks - ticks_then) / max(now - then, 1e-9),
            'ticks': ticks,
            'overruns': overruns,
            'lateness_mean': statistics.lateness_mean,
            'lateness_deviation': statistics.lateness_deviation,
            'busy': statistics.busy,
            'refused': statistics.refused,
            'procedure': self._loop.element.procedure,
        }
        if self._loop.failure:
            return self._status('loop', DiagnosticStatus.ERROR, str(self._loop.failure), values)
        if overruns > overruns_then:
            text = f'{overruns - overruns_then} ticks of wall time were skipped'
            return self._status('loop', DiagnosticStatus.WARN, text, values)
        text = 'paused' if self._loop.paused else 'running'
        return self._status('loop', DiagnosticStatus.OK, text, values)

    def _material_status(self) -> DiagnosticStatus:
        return self._status('material', DiagnosticStatus.OK, 'stable', self._material)

    def _memory_status(self) -> DiagnosticStatus:
        reading = self._loop.element.reading
        if reading is None:
            return self._status('memory', DiagnosticStatus.OK, 'not read yet', {})
        values = {
            'level': reading.level,
            'delay': 'none' if reading.delay is None else reading.delay,
            'level_margin': reading.level_margin,
            'threshold_margin': reading.threshold_margin,
        }
        bad = reading.level == UNDECODABLE
        text = reading.reason if bad else describe_level(reading.level)
        return self._status(
            'memory', DiagnosticStatus.WARN if bad else DiagnosticStatus.OK, text, values
        )

    def _recorder_status(self) -> DiagnosticStatus:
        if self.recording is None:
            return self._status('recorder', DiagnosticStatus.OK, 'not recording', {})
        status = self.recording.status
        values = {
            'path': status.path,
            'messages': status.messages,
            'bytes': status.size,
            'queued': status.queued,
            'dropped': status.dropped,
        }
        if status.error is not None:
            return self._status('recorder', DiagnosticStatus.ERROR, str(status.error), values)
        if status.dropped:
            text = f'{status.dropped} messages found no room and are missing'
            return self._status('recorder', DiagnosticStatus.WARN, text, values)
        return self._status('recorder', DiagnosticStatus.OK, status.state, values)
