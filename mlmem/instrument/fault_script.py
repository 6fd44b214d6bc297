# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Faults in the words of the field, and scripts of them.

The words are those of PX4's failure injection: a unit, a kind of failure, an instance, and here a
severity. Each becomes one or two of `Faults`; what has no counterpart here is refused. A script is
a list of such failures with the ticks at which they begin, counted from the one in which the
script takes effect.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import MISSING, dataclass
from itertools import pairwise
from typing import Any, NamedTuple

from ..errors import Refused, SettingsError
from ..parsing import DecodeError, decode_value, parse_json
from ..rejections import ErrorCode
from ..schema import describe_field, find_descriptions
from .faults import FAULT_ENDS, NO_FAULTS, Faults, OfMaterial

FAULT_UNITS = ('sensor', 'transducer', 'actuator', 'material')
"""What can fail."""

FAILURE_KINDS = ('ok', 'off', 'stuck', 'garbage', 'wrong', 'slow', 'delayed', 'intermittent')
"""How it can fail; `ok` heals the unit."""

END_UNITS = ('sensor', 'transducer')
"""Units that are there once at each end: what measures it, and what moves it."""


class Meaning(NamedTuple):
    """What a failure is here.

    Attributes:
        fault: The field of `Faults` that it sets.
        text: What it does, for the documentation.
        severity: What is set if no severity is given.
        scaled: Whether a severity may be given.
        cell: The field that takes the instance as the site of a cell; empty for none.
    """

    fault: str
    text: str
    severity: Any
    scaled: bool = True
    cell: str = ''


FAULT_MEANINGS = {
    ('sensor', 'off'): Meaning('sensor_off', 'the signal is 0', True, False),
    ('sensor', 'stuck'): Meaning(
        'sensor_dropout', 'the signal freezes at its last sample', 1.0, False
    ),
    ('sensor', 'garbage'): Meaning('sensor_noise', 'noise; severity: standard deviation', 1.0),
    ('sensor', 'wrong'): Meaning('sensor_gain', 'severity: gain', 0.5),
    ('sensor', 'slow'): Meaning('sensor_lag', 'severity: time constant', 5.0),
    ('sensor', 'delayed'): Meaning('sensor_delay', 'severity: delay', 25.0),
    ('sensor', 'intermittent'): Meaning(
        'sensor_dropout', 'severity: share of the ticks in which it freezes', 0.02
    ),
    ('transducer', 'off'): Meaning(
        'transducer_off', 'the transducer does not drive its end', True, False
    ),
    ('transducer', 'stuck'): Meaning(
        'transducer_gain', 'the transducer holds its end', 0.0, False
    ),
    ('transducer', 'wrong'): Meaning('transducer_gain', 'severity: gain of the displacement', 0.8),
    ('actuator', 'off'): Meaning(
        'actuator_stuck', 'the actuator has no power and stays', True, False
    ),
    ('actuator', 'stuck'): Meaning('actuator_stuck', 'the actuator does not move', True, False),
    ('actuator', 'wrong'): Meaning('actuator_offset', 'severity: offset of the strain', 0.01),
    ('actuator', 'slow'): Meaning('actuator_lag', 'severity: time constant', 100.0),
    ('actuator', 'intermittent'): Meaning(
        'missed_cycle', 'severity: share of the strain cycles in which the grip slips', 0.5
    ),
    ('material', 'stuck'): Meaning(
        'stuck_cell', 'the cell of the instance sticks', None, False, cell='stuck_cell'
    ),
    ('material', 'wrong'): Meaning(
        'weak_factor', 'severity: stiffness of the cell of the instance', 0.5, cell='weak_cell'
    ),
    ('material', 'garbage'): Meaning(
        'disorder_alpha', 'severity: scatter of every on-site spring', 0.01
    ),
    ('material', 'slow'): Meaning('damping_factor', 'severity: damping', 4.0),
}
"""What each failure of each unit is; there are no others but `ok`."""


@dataclass(frozen=True)
class Failure:
    """One line of a script.

    Attributes:
        tick: When it begins, in ticks after the script.
        unit: What fails.
        instance: Which sensor or transducer: 1 left, 2 right, 0 both; which cell, from 1. Of the
            actuator there is one, 0 or 1.
        severity: How badly, in the unit of the fault; None for the usual.
    """

    unit: str = describe_field(MISSING, 'what fails', choices=FAULT_UNITS)
    failure: str = describe_field(MISSING, 'how it fails', choices=FAILURE_KINDS)
    tick: int = describe_field(0, 'when, in ticks after the script begins', low=0, high=2**53)
    instance: int = describe_field(
        0, 'sensor, transducer: 0 both, 1 left, 2 right; material: the cell', low=0, high=100_000
    )
    severity: float | None = None

    def on(self, faults: Faults) -> Faults:
        """Return faults with this failure.

        Raises:
            Refused: There is none such here, or a value is out of range.
        """
        if self.failure == 'ok':
            self._check_repair(faults)
            return dataclasses.replace(
                faults, **{name: getattr(NO_FAULTS, name) for name in list_fault_fields(self.unit)}
            )
        if (meaning := FAULT_MEANINGS.get((self.unit, self.failure))) is None:
            known = ', '.join(failure for unit, failure in FAULT_MEANINGS if unit == self.unit)
            text = f'{self.unit} cannot be {self.failure}, only {known}, or ok'
            raise Refused(text, ErrorCode.OUT_OF_RANGE, 'failure', self.failure)
        given = self._select_severity(meaning)
        try:
            return dataclasses.replace(faults, **given | self._select_instance(meaning, faults))
        except SettingsError as error:
            raise Refused(
                f'{self.unit} {self.failure}: {error}', code=error.code, field=error.field
            ) from error

    def _check_repair(self, faults: Faults) -> None:
        """Raise `Refused` if only a part of the unit is to be healed, or by a measure."""
        whole = self.unit in END_UNITS and FAULT_ENDS.index(getattr(faults, f'{self.unit}_end'))
        if self.instance not in (0, whole) or self.severity is not None:
            raise Refused(
                f'{self.unit} ok heals all of it: it takes no severity, and no instance but '
                f'that which fails; got instance {self.instance}',
                ErrorCode.CONFLICT, 'instance', self.instance,
            )  # fmt: skip

    def _select_severity(self, meaning: Meaning) -> dict[str, Any]:
        if self.severity is None:
            return {} if meaning.severity is None else {meaning.fault: meaning.severity}
        if not meaning.scaled:
            text = f'{self.unit} {self.failure} has no severity; got {self.severity:g}'
            raise Refused(text, ErrorCode.CONFLICT, 'severity', self.severity)
        return {meaning.fault: self.severity}

    def _select_instance(self, meaning: Meaning, faults: Faults) -> dict[str, Any]:
        """Return what the instance sets."""
        if meaning.cell:
            if not self.instance:
                text = f'{self.unit} {self.failure} needs the site of a cell as instance'
                raise Refused(text, ErrorCode.MISSING_FIELD, 'instance')
            return {meaning.cell: self.instance}
        instances = len(FAULT_ENDS) if self.unit in END_UNITS else 2
        if self.instance >= instances or (self.unit == 'material' and self.instance):
            text = f'{self.unit} {self.failure} has no instance {self.instance}'
            raise Refused(text, ErrorCode.OUT_OF_RANGE, 'instance', self.instance)
        if self.unit not in END_UNITS:
            return {}
        which = f'{self.unit}_end'
        end, faulty = FAULT_ENDS[self.instance], getattr(faults, which)
        if end != faulty and any(name.startswith(self.unit) for name in faults.list_active()):
            text = f'the {self.unit} of {faulty} fails: heal it before that of {end} does'
            raise Refused(text, ErrorCode.CONFLICT, 'instance', self.instance)
        return {which: end}


def list_fault_fields(unit: str) -> list[str]:
    """Return the fields of `Faults` that are faults of a unit."""
    return [
        field.name
        for field, description in find_descriptions(NO_FAULTS)
        if field.name != 'seed'
        and unit
        == (
            'material' if isinstance(description, OfMaterial)
            else part if (part := field.name.partition('_')[0]) in END_UNITS else 'actuator'
        )
    ]  # fmt: skip


def parse_script(text: str) -> tuple[Failure, ...]:
    """Return the failures of a script, a list of them as JSON, in their order.

    Raises:
        Refused: It is none, or its ticks decrease.
    """
    try:
        return decode_script(parse_json(text))
    except DecodeError as error:
        raise Refused(str(error), code=error.code, field=error.field) from error


def decode_script(data: Any) -> tuple[Failure, ...]:
    """Return the failures of a script, given as plain values.

    Raises:
        DecodeError: It is none, or its ticks decrease.
    """
    script: tuple[Failure, ...] = decode_value(tuple[Failure, ...], data, 'script')
    if not 0 < len(script) <= 1000:
        raise DecodeError(
            f'a script must have from 1 to 1000 failures; got {len(script)}',
            code=ErrorCode.OUT_OF_RANGE,
        )
    if any(late.tick < early.tick for early, late in pairwise(script)):
        text = 'the ticks of a script must not decrease'
        raise DecodeError(text, 'tick', ErrorCode.CONFLICT)
    return script


def schedule_faults(
    script: Sequence[Failure], faults: Faults, begin: int = 0
) -> list[tuple[int, Faults]]:
    """Return all faults from each tick of a script on, if some are there when it begins.

    Raises:
        Refused: As `Failure.on`.
    """
    found: list[tuple[int, Faults]] = []
    for each in script:
        faults = each.on(faults)
        if found and found[-1][0] == begin + each.tick:
            found.pop()
        found.append((begin + each.tick, faults))
    return found
