# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The records of a session as checked values: header, commands and state hashes.

`messages` writes them as JSON. Nothing in a file is trusted: every value returned is finite, of
the right type and within bounds; anything else is refused with the name of the field.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from ..bag.errors import BagError
from ..clipped import clipped, printable
from ..device import Calibration, Command, Faults, Refused, SetFaults, Settings, SettingsError
from ..device.commands import KINDS
from ..device.simulation import steps_per_tick
from ..physics import Design, Specimen
from .messages import FORMAT
from .streams import PERIODIC

MOST_TICKS = 2**53
"""Ticks of a device's clock: 500 000 years at the default pace."""

MOST_HASH_EVERY = 10**6
"""Upper bound of `record.hash_every`, the ticks between two hashes; its default is 500."""


@dataclass(frozen=True)
class Header:
    """The start of a session.

    Attributes:
        design: The element.
        settings: The instrument's settings.
        initial: The state of the device, which `snapshot.restore` checks.
        versions: Versions of all that the results may depend on, by name.
        hash_every: Ticks between two hashes.
        publish_every: Ticks between two messages of a periodic stream, by topic; 0: never.
        made: The simulated element.
        forecast: The calibration that a twin forecast, or None.
    """

    design: Design
    settings: Settings
    initial: Mapping[str, Any]
    versions: Mapping[str, str]
    hash_every: int
    publish_every: Mapping[str, int]
    made: Specimen
    forecast: Calibration | None = None

    @property
    def simulated(self) -> bool:
        """Whether it holds the state of a material, which a real element cannot give."""
        return 'state' in self.initial

    @property
    def calibration(self) -> Calibration:
        """The calibration with which it began; raises BagError without one."""
        with naming('the calibration in the session header'):
            calibration = Calibration.from_dict(self.initial['calibration'])
            calibration.check(self.design.levels)
        return calibration


@dataclass(frozen=True)
class StateHash:
    """The hash of the material's state after a tick, and its displacements of shape (N,)."""

    tick: int
    hash: str
    v: NDArray[np.float64]


@contextmanager
def naming(where: str) -> Iterator[None]:
    """Add the record's name, such as ``'session/command at 12.3 s'``, to any error its content
    causes.

    Raises:
        BagError: The body raised one, or an error caused by values of the wrong type.
    """
    try:
        yield
    except BagError as error:
        raise BagError(f'{where}: {error}') from error
    except (
        *(ArithmeticError, AttributeError, LookupError, TypeError, ValueError),
        *(RecursionError, MemoryError, Refused),
    ) as error:
        raise BagError(f'{where}: {printable(str(error) or repr(error), 300)}') from error


def read_header(text: str) -> Header:
    """Parse the header from JSON; raises `BagError` or what `naming` converts."""
    values = _object(text)
    if values.get('format') != FORMAT:
        _refuse('format', str(FORMAT), values.get('format'))
    with naming('design'):
        design = Design(**_mapping(values, 'design'))
    with naming('settings'):
        settings = Settings.from_dict(_mapping(values, 'settings'))
    with naming('specimen'):
        given = values.get('specimen')
        made = Specimen(design) if given is None else Specimen.from_dict(given)
        if made.design.cells != design.cells:
            raise BagError('it must have the cells and defects of the design')
    with naming('settings'):
        steps_per_tick(made, settings.time)  # which refuses too long a tick
    forecast = None
    if 'forecast' in values:
        with naming('forecast'):
            forecast = Calibration.from_dict(_mapping(values, 'forecast'))
            forecast.check(design.levels)
    versions = _mapping(values, 'versions')
    for name, version in versions.items():
        if not isinstance(version, str):
            _refuse(f'versions.{printable(name, 40)}', 'a text', version)
    parameters = _mapping(values, 'parameters') if 'parameters' in values else {}
    hash_every = 500
    if 'record.hash_every' in parameters:
        hash_every = _whole(parameters, 'record.hash_every', 1, MOST_HASH_EVERY)
    intervals = {
        topic.name: _whole(parameters, topic.interval, 0, 10**6)
        for topic in PERIODIC
        if topic.interval in parameters
    }
    return Header(
        design, settings, _mapping(values, 'initial'), versions, hash_every, intervals, made,
        forecast,
    )  # fmt: skip


def read_command(text: str) -> tuple[int, Command]:
    """Parse a tick and its command from JSON; raises as `read_header` does."""
    values = _object(text)
    tick = _whole(values, 'tick', 0, MOST_TICKS)
    del values['tick']
    kind = KINDS.get(str(values.get('kind')))
    for field in dataclasses.fields(kind) if kind else ():
        if field.name in values:
            wanted, fits = _KINDS[str(field.type)]
            if not fits(values[field.name]):
                _refuse(field.name, wanted, values[field.name])
    return tick, command_of(values)


def command_of(data: Mapping[str, Any]) -> Command:
    """Return the command that `messages.as_dict` described.

    Raises:
        Refused: The data do not describe a command.
    """
    values = dict(data)
    kind = values.pop('kind', None)
    if not isinstance(kind, str) or kind not in KINDS:
        raise Refused(f'command must be one of {", ".join(KINDS)}; got {clipped(kind)}')
    try:
        if kind == SetFaults.__name__:
            values = {name: Faults(**given) for name, given in values.items()}
        command: Command = KINDS[kind](**values)
    except (TypeError, SettingsError) as error:
        raise Refused(f'{kind} has wrong values: {error}') from error
    return command


def read_state_hash(text: str) -> StateHash:
    """Parse a state hash from JSON; raises as `read_header` does."""
    values = _object(text)
    tick = _whole(values, 'tick', 0, MOST_TICKS)
    digest, numbers = values.get('hash'), values.get('v')
    if not isinstance(digest, str) or len(digest) != 32:
        _refuse('hash', '32 hexadecimal digits', digest)
    if not isinstance(numbers, list) or not all(isinstance(each, str) for each in numbers):
        _refuse('v', 'a list of hexadecimal numbers', numbers)
    with naming('v'):
        v = np.array([float.fromhex(number) for number in numbers])
    if not np.isfinite(v).all():
        _refuse('v', 'finite', numbers)
    return StateHash(tick, digest, v)


def _object(text: str) -> dict[str, Any]:
    try:
        values = json.loads(text, parse_constant=_no_constant)
    except (ValueError, RecursionError) as error:
        raise BagError(f'it must be a JSON object; {printable(str(error), 100)}') from error
    if not isinstance(values, dict):
        raise BagError(f'it must be a JSON object; got {clipped(text)}')
    return values


def _no_constant(name: str) -> NoReturn:
    raise ValueError(f'{name} is not JSON')


def _mapping(values: Mapping[str, Any], name: str) -> dict[str, Any]:
    value = values.get(name)
    if not isinstance(value, dict):
        _refuse(name, 'an object', value)
    return value


def _whole(values: Mapping[str, Any], name: str, low: int, high: int) -> int:
    value: Any = values.get(name)
    if not _is_whole(value) or not low <= value <= high:
        _refuse(name, f'a whole number from {low} to {high}', value)
    return int(value)


def _is_whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _is_finite(value: Any) -> bool:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:  # a whole number of hundreds of digits
        return False


def _refuse(name: str, wanted: str, value: Any) -> NoReturn:
    raise BagError(f'{name} must be {wanted}; got {clipped(value)}')


_KINDS: dict[str, tuple[str, Callable[[Any], bool]]] = {
    'int': ('a whole number', _is_whole),
    'float': ('a finite number', _is_finite),
    'str': ('a text', lambda value: isinstance(value, str)),
    'Faults': ('an object', lambda value: isinstance(value, dict)),
    'tuple[float, ...]': (
        'a list of finite numbers',
        lambda value: isinstance(value, list) and all(map(_is_finite, value)),
    ),
}
"""What a field of a command must be, by its annotation: in words, and its check."""
