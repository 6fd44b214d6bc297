# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The first frame from a rig: its properties."""

from __future__ import annotations

import dataclasses
import json
import math
from dataclasses import dataclass
from typing import Any

from ..clipped import clipped
from ..device import DriverError, Settings, SettingsError
from .frames import VERSION

NEEDED = ('strain', 'left', 'right')
"""What a rig must be able to do: strain the substrate, and drive and sense either end."""

FORMATS = ('<f4', '<f8')


@dataclass(frozen=True)
class Hello:
    """Properties of a rig.

    Attributes:
        protocol: Version of the protocol.
        name: A name for people.
        dt: Time from sample to sample, in time units.
        samples: Samples per tick.
        seconds: Time from sample to sample by its own clock, in s.
        length: Unit of its displacements, in m.
        force: Unit of its force, in N.
        zero: Its readings of the left and the right end at displacement 0.
        nodes: When in a sample it needs set-points, as fractions of the sample.
        numbers: Type of its numbers, one of `FORMATS`.
        buffer: Samples of set-points that it can hold.
        can: What it can do; see `NEEDED`.
    """

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
            DriverError: It is not the hello of a rig of this version.
        """
        try:
            said: dict[str, Any] = json.loads(payload)
            if said['protocol'] != VERSION:
                raise DriverError(
                    f'the rig uses protocol version {clipped(said["protocol"])}, '
                    f'this driver {VERSION}'
                )
            lists: dict[str, Any] = {
                name: tuple(said[name]) for name in ('zero', 'nodes', 'can') if name in said
            }
            hello = cls(**{**said, **lists})
            numbers = (hello.dt, hello.seconds, hello.length, hello.force)
            good = (
                all(0.0 < number < math.inf for number in numbers)
                and hello.samples >= 1
                and hello.numbers in FORMATS
                and len(hello.zero) == 2
                and all(map(math.isfinite, hello.zero))
                and hello.nodes[0] > 0.0
                and list(hello.nodes) == sorted(set(hello.nodes))
                and hello.nodes[-1] == 1.0
            )
        except (ValueError, TypeError, LookupError, AttributeError, RecursionError) as error:
            raise DriverError(
                f'the rig sent no valid hello: {clipped(repr(error), 200)}'
            ) from error
        if not good:
            raise DriverError(f'the hello of the rig is out of range: {clipped(said, 300)}')
        return hello

    def check(self, settings: Settings) -> None:
        """Raise `SettingsError` if settings do not fit this rig."""
        time, scale = settings.time, settings.scale
        if missing := [name for name in NEEDED if name not in self.can]:
            raise SettingsError(f'the rig {self.name} lacks {missing}')
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
