# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The report on /diagnostics: the health of the device, of its loop and of the recorder."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.node import Node

from mlmem import DriverError, End, Loop, MemoryElement

from ...contract.streams import describe_content
from ...contract.topics import DIAGNOSTICS_TOPIC, ERROR, OK, WARN, Status
from ...host import Host
from .callback_guard import CallbackGuard
from .topics import build_status

INACTIVE = Status(OK, 'inactive')


def report_material(element: MemoryElement) -> Status:
    """Report energies in k_r cells^2, `dt` in time units; warn of more than one wall at rest.

    For a real element, report the state of its driver; warn of missed samples.
    """
    values = dict(element.material)
    if not element.is_simulated:
        return Status(OK, 'a real element', values)
    found = values['walls']
    if element.is_released and found > 1 and not element.settings.holds_words:
        return Status(WARN, f'{found} walls: erase before writing', values)
    return Status(OK, 'stable', values)


def report_actuator(element: MemoryElement) -> Status:
    """Report the strain, where it is going, its limit, and the force in k_r cells."""
    part = element.actuator
    values = {
        'strain': part.strain,
        'target': part.motion.target,
        'max_strain': part.settings.max_strain,
    }
    if (force := element.driver.force()) is not None:
        values['force'] = force
    text = 'moving' if part.is_moving else 'holding' if part.strain else 'at rest'
    return Status(OK, text, values)


def report_transducer(element: MemoryElement) -> Status:
    """Report the motion of the ends in cells and delays in time units; warn of a weak echo."""
    part, reading = element.transducer, element.reading
    text = 'driving' if part.is_driving else 'listening'
    values: dict[str, Any] = {f'unrest_{end}': part.measure_unrest(end) for end in End}
    for end in End:
        values[f'delays_{end}'] = element.calibration.table(end).delays
    if reading is None:
        return Status(OK, text, values)
    margin = reading.threshold_margin
    values |= {'end': reading.end, 'threshold_margin': margin}
    if reading.level >= 0 and margin < 1.5:  # the paper's element has above 2
        return Status(WARN, f'a weak echo: {margin:.3g} times the threshold', values)
    return Status(OK, text, values)


def report_memory(element: MemoryElement) -> Status:
    """Report the last decode, its delay in time units, counts, and levels lost to known bad cells.

    Warn if it was undecodable, or if something may have moved the wall since.
    """
    reading, counts = element.reading, vars(element.statistics)
    wear: dict[str, Any] = {name: each for name, each in counts.items() if isinstance(each, int)}
    wear['mean_ticks'] = element.statistics.mean_ticks
    if element.settings.element.bad_cells:
        wear['bad_cells'] = element.reader.limits
    severity, text, found = describe_content(element)
    if reading is None:
        severity = WARN if element.unknown and not element.procedure else OK
        return Status(severity, text, {**found, **wear})
    shown = 'end', 'delay', 'level_margin', 'threshold_margin', 'confidence'
    return Status(
        severity, text, {**found, **{name: getattr(reading, name) for name in shown}, **wear}
    )


def report_faults(element: MemoryElement) -> Status:
    """Warn while a fault is set, and report which, by parameter."""
    if found := element.faults.list_active():
        return Status(WARN, f'set: {", ".join(found)}', found)
    return Status(OK, 'healthy')


def warn_missed_samples(now: Status, before: Status) -> Status:
    """Return the health of the material, with a warning if its driver has missed more samples."""
    missed = now.values.get('missed_samples', 0)
    if missed <= before.values.get('missed_samples', 0):
        return now
    return now._replace(severity=WARN, text=f'{missed} samples were missed')


ELEMENT_REPORTS: dict[str, Callable[[MemoryElement], Status]] = {
    'material': report_material,
    'actuator': report_actuator,
    'transducer': report_transducer,
    'memory': report_memory,
    'faults': report_faults,
}


REPORT_PERIOD_S = 1.0
"""Seconds between two reports."""


class Pace:
    """Reports how the loop keeps time; warns when ticks of wall time are lost."""

    def __init__(self, host: Host) -> None:
        self._host = host
        self._told = (time.monotonic(), 0)
        self._loop: Loop | None = None
        self._overruns = self._logged = self._jumps = 0

    def report_health(
        self, loop: Loop | None, procedure: str = '', *, heard: bool = True
    ) -> Status:
        """Report how the loop keeps time: in s, and its rate since the last report in ticks/s.

        Args:
            procedure: The running one.
            heard: Whether this is a report. If not, ticks that a loop at rest has slept through
                may be yet to come, and the next rate does not begin here.
        """
        if loop is None:
            text = self._host.stopped or self._host.preparing or INACTIVE.text
            refused = {'refused': self._host.log.refusals}
            return Status(ERROR if self._host.stopped else OK, text, refused)
        statistics, jumps = loop.statistics, loop.pacer.jumps
        if is_new := loop is not self._loop:
            self._loop, self._overruns, self._logged, self._jumps = loop, 0, 0, jumps
        lost, self._overruns = statistics.overruns - self._overruns, statistics.overruns
        jumped, self._jumps = jumps - self._jumps, jumps
        now = (time.monotonic(), statistics.ticks)
        seconds, ticks = (a - b for a, b in zip(now, self._told, strict=True))
        rate = max(0.0, ticks) / max(seconds, 1e-9)
        if heard or is_new:
            self._told = now
        values = {
            'rate': rate,
            'real_time_factor': rate * loop.element.settings.tick_seconds,
            'ticks': statistics.ticks,
            'overruns': statistics.overruns,
            'clock_jumps': jumps,
            'lateness_mean': statistics.lateness_mean,
            'lateness_deviation': statistics.lateness_deviation,
            'busy': statistics.busy,
            'procedure': procedure,
            'paused': loop.is_paused,
            'refused': self._host.log.refusals,
            'defects': self._host.log.caught,
        }
        if loop.failure:
            return Status(ERROR, str(loop.failure), values)
        if self._host.held_up:
            return Status(WARN, self._host.held_up, values)
        if jumped:
            self._host.log.info('the clock has jumped: the device goes on without a gap', 'clock')
        if lost > 0:
            text = f'{statistics.overruns} ticks of time were skipped'
            if statistics.overruns >= 2 * self._logged:  # log it each time it has doubled
                self._logged = statistics.overruns
                self._host.log.warning(f'{text}: the machine is too slow for this pace')
            return Status(WARN, text, values)
        return Status(OK, 'paused' if loop.is_paused else 'running', values)


def report_recorder(host: Host) -> Status:
    """Report a session; warn of dropped messages and of one at its maximum size."""
    recording = host.sessions.current
    if recording is None:
        buffer = host.sessions.buffer
        return Status(OK, 'not recording', {} if buffer is None else buffer.kept)
    values = {
        'path': recording.path,
        'messages': recording.messages,
        'bytes': recording.size,
        'queued': recording.queued,
        'dropped': recording.dropped,
    }
    if recording.error is not None:
        return Status(ERROR, str(recording.error), values)
    if dropped := recording.dropped:
        return Status(WARN, f'{dropped} messages were dropped from the recording', values)
    if recording.full:
        return Status(WARN, 'full: the session has ended at record.most_megabytes', values)
    return Status(OK, recording.state, values)


class Diagnostics:
    """Publishes one status for every component, once a period."""

    def __init__(self, node: Node, host: Host, callback_guard: CallbackGuard) -> None:
        self._name = node.get_fully_qualified_name()
        self._clock = node.get_clock()
        self._host = host
        self._pace = Pace(host)
        self._seen: dict[str, Status] = {}  # of the device, as last sampled
        self._publisher = node.create_publisher(
            DiagnosticArray, DIAGNOSTICS_TOPIC.name, DIAGNOSTICS_TOPIC.qos.profile
        )
        callback_guard.call_every(
            REPORT_PERIOD_S, DIAGNOSTICS_TOPIC.name, self._sample_and_publish
        )

    def _sample_and_publish(self) -> None:
        loop = self._host.loop
        if not self._publisher.get_subscription_count():
            self._pace.report_health(loop, heard=False)  # logs what is lost
            return
        if loop is None or loop.failure:
            self._publish_all(loop)
            return

        def sample_element() -> None:
            with self._host.log.guard_errors(DIAGNOSTICS_TOPIC.name):
                self._sample_components(loop.element)
                self._publish_all(loop, loop.element.procedure)

        loop.call(sample_element)

    def _sample_components(self, element: MemoryElement) -> None:
        before = self._seen.get('material', INACTIVE)
        self._seen = {
            name: _read_health(health, element) for name, health in ELEMENT_REPORTS.items()
        }
        self._seen['material'] = warn_missed_samples(self._seen['material'], before)

    def _publish_all(self, loop: Loop | None, procedure: str = '') -> None:
        if loop is None:
            self._seen = {}
        present = {
            'loop': self._pace.report_health(loop, procedure),
            **{name: self._seen.get(name, INACTIVE) for name in ELEMENT_REPORTS},
            'recorder': report_recorder(self._host),
        }
        statuses = [build_status(health, self._name, name) for name, health in present.items()]
        message = DiagnosticArray(status=statuses)
        message.header.stamp = self._clock.now().to_msg()
        self._publisher.publish(message)


def _read_health(health: Callable[[MemoryElement], Status], element: MemoryElement) -> Status:
    """Return a component's health; a driver that cannot tell is an error of its own."""
    try:
        return health(element)
    except DriverError as error:
        return Status(ERROR, str(error))
