# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a rig says of itself before anything else."""

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
"""What a rig must be able to do: to strain the substrate, and to hold and hear either end."""

FORMATS = ('<f4', '<f8')


@dataclass(frozen=True)
class Hello:
    """What a rig says of itself.

    Attributes:
        protocol: Version of the frames.
        name: For people.
        dt: Time from sample to sample, in time units.
        samples: Samples of a tick.
        seconds: Time from sample to sample by its own clock, in s.
        length: What 1 is in its displacements, in m.
        force: What 1 is in its force, in N.
        zero: What it tells of a left and a right end that are at 0.
        nodes: Set-points in a sample, as shares of it.
        numbers: Kind of its numbers, one of `FORMATS`.
        buffer: Samples whose set-points it can hold.
        can: What it can do.
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
        """Return it as a frame carries it."""
        return json.dumps(dataclasses.asdict(self)).encode()

    @classmethod
    def of(cls, payload: bytes) -> Hello:
        """Return what a frame carries.

        Raises:
            DriverError: It is not what a rig of this version says.
        """
        try:
            said: dict[str, Any] = json.loads(payload)
            if said['protocol'] != VERSION:
                raise DriverError(
                    f'the rig speaks version {clipped(said["protocol"])} of the frames, '
                    f'and this driver {VERSION}'
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
            raise DriverError(f'the rig says no hello: {clipped(repr(error), 200)}') from error
        if not good:
            raise DriverError(f'the hello of the rig is out of range: {clipped(said, 300)}')
        return hello

    def check(self, settings: Settings) -> None:
        """Raise `SettingsError` where settings are not for this rig."""
        time, scale = settings.time, settings.scale
        if missing := [name for name in NEEDED if name not in self.can]:
            raise SettingsError(f'the rig {self.name} cannot do what is needed: {missing}')
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
