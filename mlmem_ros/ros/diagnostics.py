# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Health on /diagnostics, once a second: loop, material and memory."""

from __future__ import annotations

import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.node import Node

from ..device import UNDECODABLE, Loop, describe_level
from ..device.loop_statistics import LoopStatistics
from ..physics import stable_step
from ..physics.energy import energy
from .gate import Gate
from .messages import key_values
from .recording import Recording

PERIOD = 1.0
"""Seconds between two reports."""

CALM_REPORTS = 5
"""Reports without a new overrun after which the loop counts as running again."""


class Diagnostics:
    """Reports one status for every component.

    The material's values are taken by `tick` in the loop's thread, where the state is whole.

    Attributes:
        recording: The session that is recorded, or None.
    """

    def __init__(self, node: Node, gate: Gate) -> None:
        self.recording: Recording | None = None
        self._node = node
        self._gate = gate
        self._publisher = node.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self._material: dict[str, Any] = {}
        self._next = 0.0
        self._last = (time.monotonic(), 0.0, 0.0)
        self._calm = CALM_REPORTS
        node.create_timer(PERIOD, self._report)

    def tick(self, loop: Loop) -> None:
        """Take the material's values where they are due."""
        now = time.monotonic()
        if now < self._next:
            return
        self._next = now + PERIOD
        element = loop.element
        parts = energy(element.chain)
        self._material = {
            'stability_margin': 1.0 - element.chain.dt / stable_step(element.design),
            'dt': element.chain.dt,
            'strain': element.actuator.strain,
            'kinetic_energy': parts.kinetic,
            'stored_energy': parts.total - parts.kinetic,
        }

    def _report(self) -> None:
        loop = self._gate.loop
        if loop is None:
            status = [self._status('loop', DiagnosticStatus.OK, 'inactive', self._refusals())]
        else:
            status = [
                self._loop_status(loop),
                self._status('material', DiagnosticStatus.OK, 'stable', self._material),
                self._memory_status(loop),
            ]
        message = DiagnosticArray(status=[*status, self._recorder_status()])
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(message)

    def _refusals(self) -> dict[str, Any]:
        return {'refused': self._gate.refused}

    def _status(self, component: str, level: bytes, text: str, values: dict[str, Any]) -> Any:
        name = f'{self._node.get_fully_qualified_name()[1:]}: {component}'
        return DiagnosticStatus(level=level, name=name, message=text, values=key_values(values))

    def _loop_status(self, loop: Loop) -> DiagnosticStatus:
        statistics = loop.statistics
        rate, new_overruns = self._since_last(statistics)
        values = {
            'rate': rate,
            'ticks': statistics.ticks,
            'overruns': statistics.overruns,
            'lateness_mean': statistics.lateness_mean,
            'lateness_deviation': statistics.lateness_deviation,
            'busy': statistics.busy,
            'procedure': loop.element.procedure,
            **self._refusals(),
        }
        if loop.failure:
            return self._status('loop', DiagnosticStatus.ERROR, str(loop.failure), values)
        if new_overruns > 0:
            self._calm = 0
        self._calm += 1
        if self._calm <= CALM_REPORTS:
            text = f'{statistics.overruns} ticks of time were skipped'
            return self._status('loop', DiagnosticStatus.WARN, text, values)
        text = 'paused' if loop.paused else 'running'
        return self._status('loop', DiagnosticStatus.OK, text, values)

    def _since_last(self, statistics: LoopStatistics) -> tuple[float, int]:
        """Return ticks per second and new overruns since the last report."""
        present = (time.monotonic(), statistics.ticks, statistics.overruns)
        seconds, ticks, overruns = (a - b for a, b in zip(present, self._last, strict=True))
        self._last = present
        return max(0.0, ticks) / max(seconds, 1e-9), round(overruns)

    def _memory_status(self, loop: Loop) -> DiagnosticStatus:
        reading = loop.element.reading
        if reading is None:
            return self._status('memory', DiagnosticStatus.OK, 'not read yet', {})
        values = {
            'level': reading.level,
            'delay': 'none' if reading.delay is None else reading.delay,
            'level_margin': reading.level_margin,
            'threshold_margin': reading.threshold_margin,
        }
        if reading.level == UNDECODABLE:
            return self._status('memory', DiagnosticStatus.WARN, reading.reason, values)
        text = describe_level(reading.level)
        return self._status('memory', DiagnosticStatus.OK, text, values)

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
