# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The node's health on /diagnostics: a function for each component, and warnings that last.

The functions in `ELEMENT` are called in the loop's thread, where the device's state is consistent.
To add one, write it and list it there; `tools/reference.py` takes its docstring and values.
"""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.node import Node

from ...contract.messages import key_values
from ...contract.topics import DIAGNOSTICS
from ...device import UNDECODABLE, Loop, MemoryElement, describe_level
from ...device.end import End
from ...host import Host
from ...physics import stable_step, walls
from ...physics.energy import energy
from ..qos import profile
from .boundary import Boundary

OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR

PERIOD = 1.0
"""Seconds between two reports."""

HOLD = 5
"""Reports for which a warning stays after its cause is gone."""

WEAK = 1.5
"""Threshold margin below which an echo may soon be missed; the paper's element has above 2."""


@dataclass(frozen=True)
class Health:
    """The health of a component.

    Attributes:
        level: OK, WARN or ERROR of diagnostic_msgs/msg/DiagnosticStatus; the aggregator decides
            when a status is stale.
        text: In a few words.
        values: By name: numbers, strings and booleans.
    """

    level: bytes
    text: str
    values: dict[str, Any] = field(default_factory=dict)


INACTIVE = Health(OK, 'inactive')


class Hysteresis:
    """Lets a warning stay for some reports, so that it is seen and does not flicker."""

    def __init__(self, hold: int = HOLD) -> None:
        self._hold = hold
        self._held: Health | None = None
        self._calm = 0

    def forget(self) -> None:
        """Drop all warnings: the node is not active."""
        self._held = None

    def smooth(self, now: Health) -> Health:
        """Return the present health, or the present values under a lasting warning."""
        if now.level == OK or (self._held and now.level < self._held.level):
            self._calm += 1
        else:
            self._held, self._calm = now, 0
        if self._calm > self._hold:
            self._held = None
        if self._held is None:
            return now
        return dataclasses.replace(now, level=self._held.level, text=self._held.text)


# --- the device, in the loop's thread ------------------------------------------------------


def material(element: MemoryElement) -> Health:
    """Report energies, in k_r (lattice constant)^2; warn of more than one wall at rest.

    For a real element, report the state of its driver; warn of missed samples.
    """
    if (chain := element.driver.chain) is None:
        return Health(OK, 'a real element', dict(element.driver.health()))
    parts, found = energy(chain), len(walls(element.design, chain.configuration))
    values = {
        'stability_margin': 1.0 - chain.dt / stable_step(chain.specimen, chain.integrator),
        'dt': chain.dt,
        'walls': found,
        'kinetic_energy': parts.kinetic,
        'stored_energy': parts.total - parts.kinetic,
    }
    if element.released and found > 1:
        return Health(WARN, f'{found} walls: erase before writing', values)
    return Health(OK, 'stable', values)


def actuator(element: MemoryElement) -> Health:
    """Report strain, target and force, the force in k_r cells."""
    part = element.actuator
    values = {
        'strain': part.strain,
        'target': part.motion.target,
        'max_strain': part.settings.max_strain,
    }
    if (force := element.driver.force()) is not None:
        values['force'] = force
    text = 'moving' if part.moving else 'holding' if part.strain else 'at rest'
    return Health(OK, text, values)


def transducer(element: MemoryElement) -> Health:
    """Report the motion of the ends, in cells, and the delays of levels; warn of a weak echo."""
    part, reading = element.transducer, element.reading
    text = 'driving' if part.driving else 'listening'
    values: dict[str, Any] = {f'unrest_{end}': part.unrest(end) for end in End}
    for end in element.calibration.ends:
        delays = element.calibration.table(end).delays
        values[f'delays_{end}'] = ' '.join(f'{delay:g}' for delay in delays)
    if reading is None:
        return Health(OK, text, values)
    margin = reading.threshold_margin
    values |= {'end': reading.end, 'threshold_margin': margin}
    if reading.level >= 0 and margin < WEAK:
        return Health(WARN, f'a weak echo: {margin:.3g} times the threshold', values)
    return Health(OK, text, values)


def memory(element: MemoryElement) -> Health:
    """Report the last decode with its margins, and the counts; warn if it was undecodable."""
    reading, wear = element.reading, element.statistics.as_dict()
    if reading is None:
        return Health(OK, 'not read yet', wear)
    values = {
        'level': reading.level,
        'end': reading.end,
        'delay': 'none' if reading.delay is None else reading.delay,
        'level_margin': reading.level_margin,
        'threshold_margin': reading.threshold_margin,
        'confidence': reading.confidence,
        **wear,
    }
    if reading.level == UNDECODABLE:
        return Health(WARN, reading.reason, values)
    return Health(OK, describe_level(reading.level), values)


def faults(element: MemoryElement) -> Health:
    """Warn while a fault is set, and report which, by parameter."""
    if found := element.faults.active():
        return Health(WARN, f'set: {", ".join(found)}', found)
    return Health(OK, 'healthy')


def compared(now: Health, before: Health) -> Health:
    """Return the health of the material, with a warning if its driver has missed more samples."""
    missed = now.values.get('missed_samples', 0)
    if missed <= before.values.get('missed_samples', 0):
        return now
    return dataclasses.replace(now, level=WARN, text=f'{missed} samples were missed')


ELEMENT: dict[str, Callable[[MemoryElement], Health]] = {
    'material': material,
    'actuator': actuator,
    'transducer': transducer,
    'memory': memory,
    'faults': faults,
}


# --- loop and recorder, in the executor's thread -------------------------------------------


class Pace:
    """Reports how the loop keeps time; warns when ticks of wall time are lost."""

    def __init__(self, host: Host) -> None:
        self._host = host
        self._last = (time.monotonic(), 0, 0)
        self._logged = 0

    def health(self, loop: Loop | None) -> Health:
        """Return how the loop has kept time since the last report; all times in seconds."""
        if loop is None:
            self._logged = 0
            refused = {'refused': self._host.refused}
            if self._host.stopped:
                return Health(ERROR, self._host.stopped, refused)
            return dataclasses.replace(INACTIVE, values=refused)
        statistics, last = loop.statistics, self._last
        self._last = (time.monotonic(), statistics.ticks, statistics.overruns)
        seconds, ticks, lost = (a - b for a, b in zip(self._last, last, strict=True))
        rate = max(0.0, ticks) / max(seconds, 1e-9)
        values = {
            'rate': rate,
            'real_time_factor': rate * loop.tick_seconds,
            'ticks': statistics.ticks,
            'overruns': statistics.overruns,
            'lateness_mean': statistics.lateness_mean,
            'lateness_deviation': statistics.lateness_deviation,
            'busy': statistics.busy,
            'procedure': loop.element.procedure,
            'paused': loop.paused,
            'refused': self._host.refused,
            'defects': self._host.journal.caught,
        }
        if loop.failure:
            return Health(ERROR, str(loop.failure), values)
        if lost > 0:
            text = f'{statistics.overruns} ticks of time were skipped'
            if statistics.overruns >= 2 * self._logged:  # log it each time it has doubled
                self._logged = statistics.overruns
                self._host.journal.warning(f'{text}: the machine is too slow for this pace')
            return Health(WARN, text, values)
        return Health(OK, 'paused' if loop.paused else 'running', values)


def recorder(host: Host) -> Health:
    """Warn of dropped messages and of a session at its maximum size; report a failed one."""
    recording = host.sessions.current
    if recording is None:
        last = host.sessions.last
        return Health(OK, host.sessions.state.value, last.kept if last is not None else {})
    status = recording.status
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


# --- the report ----------------------------------------------------------------------------


class Diagnostics:
    """Publishes one status for every component, once a period."""

    def __init__(self, node: Node, host: Host, boundary: Boundary) -> None:
        self._name = node.get_fully_qualified_name()
        self._clock = node.get_clock()
        self._host = host
        self._boundary = boundary
        self._pace = Pace(host)
        self._seen: dict[str, Health] = {}  # of the device, as last sampled
        self._held = {name: Hysteresis() for name in ('loop', *ELEMENT, 'recorder')}
        self._publisher = node.create_publisher(
            DiagnosticArray, DIAGNOSTICS.name, profile(DIAGNOSTICS.qos)
        )
        boundary.every(PERIOD, DIAGNOSTICS.name, self._report)

    def announce(self, text: str) -> None:
        """Report what keeps the node from reporting by itself; from any thread."""
        self._publish({'loop': Health(OK, text)})

    def _report(self) -> None:
        loop, guarded = self._host.loop, self._boundary.guarded
        if loop is None or loop.failure:
            self._publish_all(loop)
            return

        def look() -> None:
            before = self._seen.get('material', INACTIVE)
            self._seen = {name: health(loop.element) for name, health in ELEMENT.items()}
            self._seen['material'] = compared(self._seen['material'], before)

        where = DIAGNOSTICS.name
        publish = guarded(where, lambda _: self._publish_all(loop))
        loop.call(guarded(where, look)).add_done_callback(publish)

    def _publish_all(self, loop: Loop | None) -> None:
        if loop is None:
            self._seen = {}
            for held in self._held.values():
                held.forget()
        present = {
            'loop': self._pace.health(loop),
            **{name: self._seen.get(name, INACTIVE) for name in ELEMENT},
            'recorder': recorder(self._host),
        }
        self._publish({name: self._held[name].smooth(now) for name, now in present.items()})

    def _publish(self, present: dict[str, Health]) -> None:
        message = DiagnosticArray()
        for component, health in present.items():
            status = DiagnosticStatus(level=health.level, message=health.text)
            status.name, status.hardware_id = f'{self._name[1:]}: {component}', self._name
            status.values = key_values(health.values)
            message.status.append(status)
        message.header.stamp = self._clock.now().to_msg()
        self._publisher.publish(message)
