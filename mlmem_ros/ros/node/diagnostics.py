# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The report on /diagnostics: the health of the device, of its loop and of the recorder."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.node import Node

from ...contract.messages import key_values
from ...contract.topics import DIAGNOSTICS
from ...device import DriverError, Loop, MemoryElement, Reading
from ...host import Host
from ..qos import profile
from .callback_guard import CallbackGuard
from .components import ELEMENT, ERROR, INACTIVE, OK, WARN, Health, Hysteresis, compared

PERIOD = 1.0
"""Seconds between two reports."""


class Pace:
    """Reports how the loop keeps time; warns when ticks of wall time are lost."""

    def __init__(self, host: Host) -> None:
        self._host = host
        self._told = (time.monotonic(), 0)
        self._loop: Loop | None = None
        self._overruns = 0
        self._jumps: int | None = None
        self._logged = 0

    def health(self, loop: Loop | None, procedure: str = '', *, heard: bool = True) -> Health:
        """Report how the loop keeps time: in s, and its rate since the last report in ticks/s.

        Args:
            loop: The loop, if there is one.
            procedure: The running one.
            heard: Whether this is a report. If not, ticks that a loop at rest has slept through
                may be yet to come, and the next rate does not begin here.
        """
        if loop is None:
            self._logged, self._jumps = 0, None
            refused = {'refused': self._host.refused}
            if self._host.stopped:
                return Health(ERROR, self._host.stopped, refused)
            return dataclasses.replace(INACTIVE, values=refused)
        statistics = loop.statistics
        lost, self._overruns = statistics.overruns - self._overruns, statistics.overruns
        now = (time.monotonic(), statistics.ticks)
        seconds, ticks = (a - b for a, b in zip(now, self._told, strict=True))
        rate = max(0.0, ticks) / max(seconds, 1e-9)
        if heard or loop is not self._loop:
            self._loop, self._told = loop, now
        values = {
            'rate': rate,
            'real_time_factor': rate * loop.element.settings.tick_seconds,
            'ticks': statistics.ticks,
            'overruns': statistics.overruns,
            'clock_jumps': loop.pacer.jumps,
            'lateness_mean': statistics.lateness_mean,
            'lateness_deviation': statistics.lateness_deviation,
            'busy': statistics.busy,
            'procedure': procedure,
            'paused': loop.paused,
            'refused': self._host.refused,
            'defects': self._host.log.caught,
        }
        if loop.failure:
            return Health(ERROR, str(loop.failure), values)
        jumps = loop.pacer.jumps
        jumped, self._jumps = jumps - (jumps if self._jumps is None else self._jumps), jumps
        if jumped == 1:
            self._host.log.info('the clock has jumped: the device goes on without a gap')
        if jumped > 1:
            slack = loop.pacer.slack
            return Health(
                WARN, f'the clock advances in steps of more than {slack:g} s: time stands still',
                values,
            )  # fmt: skip
        if lost > 0:
            text = f'{statistics.overruns} ticks of time were skipped'
            if statistics.overruns >= 2 * self._logged:  # log it each time it has doubled
                self._logged = statistics.overruns
                self._host.log.warning(f'{text}: the machine is too slow for this pace')
            return Health(WARN, text, values)
        return Health(OK, 'paused' if loop.paused else 'running', values)


def recorder(host: Host) -> Health:
    """Report a session, its wait in s; warn of dropped messages and of one at its maximum size."""
    recording, status = host.sessions.current, host.sessions.status
    if recording is None or status is None:
        buffer = host.sessions.buffer
        return Health(OK, host.sessions.state.value, {} if buffer is None else buffer.kept)
    values = {
        'path': status.path,
        'messages': status.messages,
        'bytes': status.size,
        'queued': status.queued,
        'dropped': status.dropped,
        'longest_wait': round(status.longest_wait, 3),
    }
    if status.error is not None:
        return Health(ERROR, str(status.error), values)
    if status.dropped:
        return Health(WARN, f'{status.dropped} messages were dropped from the recording', values)
    if recording.full:
        return Health(WARN, 'full: the session has ended at record.most_megabytes', values)
    return Health(OK, status.state, values)


def twin(host: Host) -> Health:
    """Report the residual of reads against a twin's forecast, in cells; warn of what changed."""
    if (watcher := host.watcher) is None:
        return Health(OK, 'no twin')
    values = watcher.values()
    return (
        Health(WARN, watcher.text, values) if watcher.text else Health(OK, 'as forecast', values)
    )


class Diagnostics:
    """Publishes one status for every component, once a period."""

    def __init__(self, node: Node, host: Host, callback_guard: CallbackGuard) -> None:
        self._name = node.get_fully_qualified_name()
        self._clock = node.get_clock()
        self._host = host
        self._callback_guard = callback_guard
        self._pace = Pace(host)
        self._seen: dict[str, Health] = {}  # of the device, as last sampled
        self._still: tuple[int, Reading | None] | None = None  # what it rests with as sampled
        self._made: dict[str, tuple[Health, DiagnosticStatus]] = {}
        self._held = {name: Hysteresis() for name in ('loop', *ELEMENT, 'twin', 'recorder')}
        self._held['memory'] = Hysteresis(0)  # what it held before is not so
        self._publisher = node.create_publisher(
            DiagnosticArray, DIAGNOSTICS.name, profile(DIAGNOSTICS.qos)
        )
        callback_guard.every(PERIOD, DIAGNOSTICS.name, self._report)

    def announce(self, text: str) -> None:
        """Report what keeps the node from reporting by itself; from any thread."""
        self._publish({'loop': Health(OK, text)})

    def _report(self) -> None:
        loop = self._host.loop
        if not self._publisher.get_subscription_count():
            self._pace.health(loop, heard=False)  # logs what is lost
            return
        if loop is None or loop.failure:
            self._publish_all(loop)
            return

        def look() -> None:
            self._look(loop.element)
            self._publish_all(loop, loop.element.procedure)

        loop.call(self._callback_guard.guarded(DIAGNOSTICS.name, look))

    def _look(self, element: MemoryElement) -> None:
        """Sample the components; an element at rest is as it was."""
        still = (element.computed, element.reading) if element.at_rest else None
        if still is not None and still == self._still:
            return
        before, self._still = self._seen.get('material', INACTIVE), still
        self._seen = {name: _seen(health, element) for name, health in ELEMENT.items()}
        self._seen['material'] = compared(self._seen['material'], before)

    def _publish_all(self, loop: Loop | None, procedure: str = '') -> None:
        if loop is None:
            self._seen, self._still = {}, None
            for held in self._held.values():
                held.forget()
        present = {
            'loop': self._pace.health(loop, procedure),
            **{name: self._seen.get(name, INACTIVE) for name in ELEMENT},
            'twin': twin(self._host),
            'recorder': recorder(self._host),
        }
        self._publish({name: self._held[name].smooth(now) for name, now in present.items()})

    def _publish(self, present: dict[str, Health]) -> None:
        message = DiagnosticArray()
        for component, health in present.items():
            if component not in self._made or self._made[component][0] != health:
                self._made[component] = health, self._status(component, health)
            message.status.append(self._made[component][1])
        message.header.stamp = self._clock.now().to_msg()
        self._publisher.publish(message)

    def _status(self, component: str, health: Health) -> DiagnosticStatus:
        status = DiagnosticStatus(level=health.level, message=health.text)
        status.name, status.hardware_id = f'{self._name[1:]}: {component}', self._name
        status.values = key_values(health.values)
        return status


def _seen(health: Callable[[MemoryElement], Health], element: MemoryElement) -> Health:
    """Return a component's health; a driver that cannot tell is an error of its own."""
    try:
        return health(element)
    except DriverError as error:
        return Health(ERROR, str(error))
