# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The health of the components of a device: a function for each, and warnings that last.

The functions in `ELEMENT` are called in the loop's thread, where the device's state is consistent.
To add one, write it and list it there; `tools/reference.py` takes its docstring and values.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus

from ...contract.values import content
from ...device import UNDECODABLE, MemoryElement, describe_level
from ...device.end import End
from ...physics import stable_step, walls
from ...physics.energy import energy

OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR

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


def material(element: MemoryElement) -> Health:
    """Report energies in k_r cells^2, `dt` in time units; warn of more than one wall at rest.

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
    """Report the strain, where it is going, its limit, and the force in k_r cells."""
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
    """Report the motion of the ends in cells and delays in time units; warn of a weak echo."""
    part, reading = element.transducer, element.reading
    text = 'driving' if part.driving else 'listening'
    values: dict[str, Any] = {f'unrest_{end}': part.unrest(end) for end in End}
    for end in element.calibration.ends:
        values[f'delays_{end}'] = element.calibration.table(end).delays
    if reading is None:
        return Health(OK, text, values)
    margin = reading.threshold_margin
    values |= {'end': reading.end, 'threshold_margin': margin}
    if reading.level >= 0 and margin < WEAK:
        return Health(WARN, f'a weak echo: {margin:.3g} times the threshold', values)
    return Health(OK, text, values)


def memory(element: MemoryElement) -> Health:
    """Report the last decode, its delay in time units, counts, and levels lost to known bad cells.

    Warn if it was undecodable, or if something may have moved the wall since.
    """
    reading, wear = element.reading, dict[str, Any](element.statistics.as_dict())
    if element.bad_cells is not None:
        wear['bad_cells'] = str(element.bad_cells)
    if reading is None:
        text, found = content(element)
        return Health(
            WARN if element.unknown and not element.procedure else OK, text, {**found, **wear}
        )
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
