# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The first frame from a rig: its properties."""

from __future__ import annotations

import dataclasses
import json
import math
import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ..clipped import clipped
from ..device import DriverError, Settings, SettingsError
from .frames import VERSION

NEEDED = ('strain', 'left', 'right')
"""What a rig must be able to do: strain the substrate, and drive and sense either end."""

FORMATS = ('<f4', '<f8')


def _number(value: Any) -> bool:
    return type(value) in (int, float) and abs(value) <= sys.float_info.max


def _positive(value: Any) -> bool:
    return _number(value) and value > 0.0


def _count(value: Any) -> bool:
    return type(value) is int and value >= 1


def _list_of(fits: Callable[[Any], bool]) -> Callable[[Any], bool]:
    return lambda value: isinstance(value, list) and bool(value) and all(map(fits, value))


def _shares(value: Any) -> bool:
    rising = _list_of(_positive)(value) and value == sorted(set(value))
    return rising and bool(value[-1] == 1.0)


WANTED: dict[str, tuple[str, Callable[[Any], bool]]] = {
    'protocol': (str(VERSION), lambda value: value == VERSION),
    'name': ('a text', lambda value: isinstance(value, str)),
    'dt': ('a number above 0, the time units from sample to sample', _positive),
    'samples': ('a whole number above 0, the samples of a tick: time.tick / dt', _count),
    'seconds': (
        'a number above 0, the seconds of a sample by its clock: scale.time dt',
        _positive,
    ),
    'length': (
        'a number above 0, the m of a unit of displacement: scale.length if that is a cell',
        _positive,
    ),
    'buffer': ('a whole number above 0, the samples of set-points it can hold', _count),
    'force': ('a number above 0, the N of a unit of force', _positive),
    'zero': (
        'a list of two numbers, the readings of the left and the right end at displacement 0',
        lambda value: _list_of(_number)(value) and len(value) == 2,
    ),
    'nodes': (
        'a list of rising numbers above 0, the last one 1: when in a sample it takes set-points',
        _shares,
    ),
    'numbers': (' or '.join(FORMATS), lambda value: value in FORMATS),
    'can': (
        f'a list of texts with {", ".join(NEEDED)}',
        _list_of(lambda value: isinstance(value, str)),
    ),
}
"""What each key of a hello must be: in words, and as a check."""


@dataclass(frozen=True)
class Hello:
    """Properties of a rig, named and described in `WANTED`."""

    protocol: int
    name: str
    dt: float
    samples: int
    seconds: float
    length: float
    buffer: int
    force: float = 1.0
    zero: tuple[float, float] = (0.0, 0.0)
    nodes: tuple[float, ...] = (1.0,)
    numbers: str = '<f8'
    can: tuple[str, ...] = NEEDED

    def payload(self) -> bytes:
        """Return the payload of its frame."""
        return json.dumps(dataclasses.asdict(self)).encode()

    @classmethod
    def of(cls, payload: bytes) -> Hello:
        """Read the payload of a frame.

        Raises:
            DriverError: It is not the hello of a rig of this version; the message names the key.
        """
        try:
            said = json.loads(payload)
        except (ValueError, RecursionError) as error:
            raise DriverError(
                f'the hello of the rig must be a JSON object; got {clipped(payload)}: {error}'
            ) from None
        if not isinstance(said, dict):
            raise DriverError(f'the hello of the rig must be a JSON object; got {clipped(said)}')
        if said.get('protocol', VERSION) != VERSION:
            raise DriverError(
                f'the rig uses protocol version {clipped(said["protocol"])}, this driver {VERSION}'
            )
        fields = {field.name: field for field in dataclasses.fields(cls)}
        for name, field in fields.items():
            what, fits = WANTED[name]
            if name not in said:
                if field.default is dataclasses.MISSING:
                    raise DriverError(f'the hello of the rig lacks {name}: it must be {what}')
            elif not fits(said[name]):
                raise DriverError(
                    f'{name} in the hello of the rig must be {what}; got {clipped(said[name])}'
                )
        if unknown := sorted(said.keys() - fields.keys()):
            raise DriverError(
                f'{clipped(unknown[0])} in the hello of the rig is not one of {", ".join(fields)}'
            )
        values: dict[str, Any] = {
            name: tuple(value) if isinstance(value, list) else value
            for name, value in said.items()
        }
        return cls(**values)

    def check(self, settings: Settings) -> None:
        """Raise `SettingsError` if settings do not fit this rig."""
        time, scale = settings.time, settings.scale
        if missing := [name for name in NEEDED if name not in self.can]:
            raise SettingsError(
                f'can in the hello of the rig must have {", ".join(NEEDED)}; it lacks '
                f'{", ".join(missing)}'
            )
        if not math.isclose(self.samples * self.dt, time.tick, rel_tol=1e-9):
            raise SettingsError(
                f'time.tick must be that of the rig, {self.samples * self.dt:.10g}; '
                f'got {time.tick:g}'
            )
        if not math.isclose(self.seconds / self.dt, scale.time, rel_tol=1e-6):
            raise SettingsError(
                f'scale.time must be that of the rig, {self.seconds / self.dt:.6g} s; '
                f'got {scale.time:g}'
            )
