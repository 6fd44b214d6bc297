# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The first frame from a rig: its properties."""

from __future__ import annotations

import dataclasses
import json
import math
from dataclasses import MISSING, dataclass
from functools import partial

from ..clipped import clipped
from ..described import described
from ..device import DriverError, Settings, SettingsError
from ..outside import DecodeError, decode, from_json
from .frames import VERSION

STRAIN = 'strain'
"""What a rig with an actuator can do. Without one its element is written by kicks and pushes."""

NEEDED = ('left', 'right')
"""What a rig must be able to do: drive and sense either end."""

FORMATS = ('<f4', '<f8')

_number = partial(described, MISSING, low=1e-15, high=1e15)
_count = partial(described, MISSING, low=1, high=2**31 - 1)


@dataclass(frozen=True)
class Hello:
    """Properties of a rig."""

    protocol: int = described(MISSING, 'version of the protocol', low=VERSION, high=VERSION)
    name: str = described(MISSING, 'its name')
    dt: float = _number('time units from sample to sample')
    samples: int = _count('samples of a tick: time.tick / dt')
    seconds: float = _number('seconds of a sample by its clock: scale.time dt')
    length: float = _number('m of a unit of displacement: scale.length if that is a cell')
    buffer: int = _count('samples of set-points it can hold')
    force: float = described(1.0, 'N of a unit of force', low=1e-15, high=1e15)
    zero: tuple[float, float] = described(
        (0.0, 0.0), 'readings of the left and the right end at displacement 0'
    )
    nodes: tuple[float, ...] = described(
        (1.0,),
        'when in a sample it takes set-points: a list of rising numbers above 0, the last one 1',
    )
    numbers: str = described('<f8', 'type of set-points and samples', choices=FORMATS)
    can: tuple[str, ...] = described(
        (STRAIN, *NEEDED),
        f'a list of texts with {", ".join(NEEDED)}, and {STRAIN} if there is an actuator',
    )

    def __post_init__(self) -> None:
        nodes = self.nodes
        if not nodes or list(nodes) != sorted(set(nodes)) or nodes[0] <= 0.0 or nodes[-1] != 1.0:
            raise ValueError(
                f'nodes must be rising numbers above 0, the last one 1; got {clipped(nodes)}'
            )

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
            said = from_json(payload)
            if isinstance(said, dict) and said.get('protocol', VERSION) != VERSION:
                raise DecodeError(
                    f'the rig uses protocol version {clipped(said["protocol"])}, this driver '
                    f'{VERSION}'
                )
            hello: Hello = decode(cls, said)
        except DecodeError as error:
            raise DriverError(f'the hello of the rig: {error}') from error
        return hello

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
