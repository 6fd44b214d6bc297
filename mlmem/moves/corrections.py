# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is known of an element's own moves: which pulse takes the wall up to each level.

Fabrication gives every level a slightly different well. A step that falls short, does not start or
runs over with the pulse in the settings is made with another peak or other times
(docs/learning.md): both decide how the wall swings into its well.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from typing import Any

from ..errors import Checked
from ..move_settings import WriteSettings
from ..schema import described
from ..settings import Settings


@dataclass(frozen=True)
class PulseCorrection(Checked):
    """Factors on the pulse of a step up, or of the launch of the wall."""

    peak: float = described(1.0, 'on its strains', low=0.1, high=10.0)
    times: float = described(1.0, 'on its ramps and rests', low=0.1, high=10.0)
    speed: float = described(1.0, 'on the speed of a launch or kick; 0: no kick', high=10.0)


AS_SET = PulseCorrection()
"""The pulse in the settings."""

UNKICKED = PulseCorrection(speed=0.0)
"""For a level that no kick reaches: a step up, with the pulse in the settings."""

# The menus: rows of peak, times and, for launches, speed; one column per pulse.

QUICKER = tuple(map(
    PulseCorrection,
    (1.0, 0.9, 0.8, 1.0, 0.8, 1.6, 0.9, 1.15, 0.7, 0.6, 1.3, 0.7),
    (0.42, 0.3, 0.5, 0.5, 0.36, 0.42, 0.5, 0.42, 0.2, 0.36, 0.5, 0.42),
))  # fmt: skip
"""For cycles that ramp straight back, which are slow: faster, the wall swings over what holds
it half-way. Faster still, cells at the right end slip into a third ground state."""

STRONGER = tuple(map(
    PulseCorrection,
    (1.5, 1.8, 2.2, 1.15, 1.5, 1.3, 0.8, 0.8, 0.9, 1.8, 1.0, 0.9, 2.2, 1.15, 1.15, 0.8),
    (1.3, 1.3, 2.2, 1.0, 2.2, 1.0, 1.0, 1.3, 1.3, 2.2, 1.3, 2.2, 1.6, 1.3, 2.2, 1.6),
))  # fmt: skip
"""For cycles that ease the strain, which are as fast as an ideal element allows."""

LAUNCHES = tuple(map(
    PulseCorrection,
    (1.25, 2.2, 1.0, 1.5, 0.8, 1.25, 1.0),
    (0.3, 0.3, 0.3, 0.5, 0.5, 0.3, 1.0),
    (2.0, 2.0, 2.0, 2.0, 2.0, 3.0, 2.0),
))  # fmt: skip
"""For a launch before such cycles: after too slow a start the wall turns back."""


KICKS = tuple(
    PulseCorrection(speed=speed) for speed in (1.0, 1.04, 0.96, 1.08, 0.92, 1.12, 0.88, 1.17, 0.83)
)
"""For kicks: the speed selects the level, and disorder shifts where its window is."""


def menu(settings: Settings, level: int) -> tuple[PulseCorrection, ...]:
    """Return the pulses to try for a step up to a level, best first: each rescues most of the
    steps left by those before.
    """
    if kicked(settings, level):
        return KICKS
    if not settings.write.ease:
        return (AS_SET, *QUICKER)
    return (AS_SET, *(STRONGER if level else LAUNCHES))


TIMES = ('ramp', 'hold', 'ease', 'release', 'settle')
"""The fields of `WriteSettings` whose time a correction scales."""

STRAINS = ('compression', 'tension', 'start_strain')
"""The fields whose strain it scales, within the limit of the actuator."""


def corrected(settings: Settings, correction: PulseCorrection) -> Settings:
    """Return settings that make every step with the corrected pulse."""
    write = corrected_write(settings.write, correction, settings.actuator.max_strain)
    return dataclasses.replace(settings, write=write)


def corrected_write(
    write: WriteSettings, correction: PulseCorrection, limit: float = math.inf
) -> WriteSettings:
    """Return the cycle of a write times a correction; its strains stay within a limit."""
    changed = {name: correction.times * getattr(write, name) for name in TIMES}
    changed['launch_speed'] = min((correction.speed or 1.0) * write.launch_speed, 10.0)
    for name in STRAINS:
        changed[name] = max(-limit, min(correction.peak * getattr(write, name), limit))
    return dataclasses.replace(write, **changed)


@dataclass(frozen=True)
class PulseCorrections:
    """What was learnt with one schedule.

    Attributes:
        steps: By the level to which a pulse takes the wall; the first is the launch.
        schedule: `schedule_of` the settings; with others the corrections are meaningless.
        kinks: Factors on the speeds of a register's kinks, by level; of walls they are in `steps`.
    """

    steps: tuple[PulseCorrection, ...]
    schedule: str
    kinks: tuple[float, ...] = described((), 'of kinks', low=0.1, high=10.0)

    def as_dict(self) -> dict[str, Any]:
        """Return the values for a file."""
        steps = [list(dataclasses.astuple(step)) for step in self.steps]
        kinks = {'kinks': list(self.kinks)} if self.kinks else {}
        return {'steps': steps, 'schedule': self.schedule, **kinks}


def kicked(settings: Settings, level: int) -> bool:
    """Return whether a calibration takes the wall to a level by a kick."""
    speeds = settings.kick.by_level
    return settings.write.method == 'kick' and level < len(speeds) and speeds[level] > 0.0


def without_kicks(settings: Settings, levels: Collection[int]) -> Settings:
    """Return settings without kicks to some levels."""
    speeds = [
        0.0 if level in levels else speed for level, speed in enumerate(settings.kick.by_level)
    ]
    kick = dataclasses.replace(settings.kick, speeds=' '.join(map(str, speeds)))
    return dataclasses.replace(settings, kick=kick)


def schedule_of(settings: Settings) -> str:
    """Return a hash of all settings that shape the pulses of a write."""
    write, actuator = settings.write, settings.actuator
    values = [getattr(write, name) for name in (*TIMES, *STRAINS, 'ease_to', 'launch_speed')]
    values += [write.last_release, actuator.max_strain, actuator.max_rate]
    if write.method == 'kick':
        values += [settings.kick.speeds, settings.kick.hold]
        values += [given for given in (settings.kick.late, settings.kick.kinks) if given]
    text = json.dumps(values)  # every bit of a float
    return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()


def learnt(steps: Iterable[PulseCorrection], settings: Settings) -> PulseCorrections | None:
    """Return the corrections learnt with these settings, or None if all pulses are as set."""
    steps = tuple(steps)
    return None if set(steps) == {AS_SET} else PulseCorrections(steps, schedule_of(settings))
