# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Corrections of an element's moves: factors on the pulse that takes the wall to each level.

Fabrication gives every level a slightly different well. `mlmem plan` finds the corrections of a
fitted element, and a calibration finds the speeds of its kicks.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from .errors import Checked
from .schema import describe_field

if TYPE_CHECKING:
    from .moves.strain_cycle import WriteSettings
    from .settings import Settings


@dataclass(frozen=True)
class PulseCorrection(Checked):
    """Factors on the pulse of a step up, or of the launch of the wall."""

    peak: float = describe_field(1.0, 'on its strains', low=0.1, high=10.0)
    times: float = describe_field(1.0, 'on its ramps and rests', low=0.1, high=10.0)
    speed: float = describe_field(1.0, 'on the speed of a launch or kick; 0: no kick', high=10.0)


def apply_correction(settings: Settings, correction: PulseCorrection) -> Settings:
    """Return settings that make every step with the corrected pulse."""
    write = correct_write(settings.write, correction, settings.actuator.max_strain)
    return dataclasses.replace(settings, write=write)


def correct_write(
    write: WriteSettings, correction: PulseCorrection, limit: float = math.inf
) -> WriteSettings:
    """Return the cycle of a write times a correction; its strains stay within a limit."""
    times = correction.times
    compression, tension, start_strain = (
        max(-limit, min(correction.peak * strain, limit))
        for strain in (write.compression, write.tension, write.start_strain)
    )
    return dataclasses.replace(
        write,
        compression=compression,
        tension=tension,
        start_strain=start_strain,
        ramp=times * write.ramp,
        hold=times * write.hold,
        ease=times * write.ease,
        release=times * write.release,
        settle=times * write.settle,
        launch_speed=min((correction.speed or 1.0) * write.launch_speed, 10.0),
    )


@dataclass(frozen=True)
class PulseCorrections:
    """The corrections of one element, which belong to one schedule.

    Attributes:
        steps: By the level to which a pulse takes the wall; the first is of the launch.
        schedule: `hash_schedule` the settings; with others the corrections are meaningless.
        kinks: Factors on the speeds of a register's kinks, by level; of walls they are in `steps`.
    """

    steps: tuple[PulseCorrection, ...]
    schedule: str
    kinks: tuple[float, ...] = describe_field((), 'of kinks', low=0.1, high=10.0)


def is_kicked(settings: Settings, level: int) -> bool:
    """Return whether a calibration takes the wall to a level by a kick."""
    speeds = settings.kick.wall_speeds
    return settings.write.avoids_strain and level < len(speeds) and speeds[level] > 0.0


def remove_kicks(settings: Settings, levels: Collection[int]) -> Settings:
    """Return settings without kicks to some levels."""
    speeds = [
        0.0 if level in levels else speed for level, speed in enumerate(settings.kick.wall_speeds)
    ]
    kick = dataclasses.replace(settings.kick, speeds=' '.join(map(str, speeds)))
    return dataclasses.replace(settings, kick=kick)


def hash_schedule(settings: Settings) -> str:
    """Return a hash of all settings that shape the pulses of a write."""
    write, actuator = settings.write, settings.actuator
    names = (
        'ramp', 'hold', 'ease', 'release', 'settle', 'compression', 'tension', 'start_strain',
        'ease_to', 'launch_speed', 'last_release',
    )  # fmt: skip
    values: list[float | str] = [getattr(write, name) for name in names]
    values += [actuator.max_strain, actuator.max_rate]
    if write.avoids_strain:
        values += [settings.kick.speeds, settings.kick.hold]
        values += [given for given in (settings.kick.late, settings.kick.kinks) if given]
    text = json.dumps(values)  # every bit of a float
    return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()


def make_corrections(
    steps: Iterable[PulseCorrection], settings: Settings
) -> PulseCorrections | None:
    """Return the corrections that belong to these settings, or None if all pulses are as set."""
    steps = tuple(steps)
    if set(steps) == {PulseCorrection()}:
        return None
    return PulseCorrections(steps, hash_schedule(settings))


def corrections_by_level(
    known: PulseCorrections | None, settings: Settings, levels: int
) -> list[PulseCorrection]:
    """Return the corrections by the level to which a pulse takes the wall.

    Without any, and with those of another schedule, all pulses are as set.
    """
    if known is None or known.schedule != hash_schedule(settings):
        return [PulseCorrection()] * levels
    return list(known.steps)
