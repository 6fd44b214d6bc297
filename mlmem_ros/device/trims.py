# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What an element has learnt of its own steps: which pulse takes the wall up from each level.

Fabrication leaves every level another well and another way to the next. A step that stops short,
stays or runs over with the pulse in the settings is made with another peak or other times
(docs/learning.md): how a wall swings into its well depends on both.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from ..clipped import clipped
from ..described import described
from .errors import SettingsError
from .settings import Checked, Settings


@dataclass(frozen=True)
class Trim(Checked):
    """Factors on the pulse of a step up, or of the launch of the wall."""

    peak: float = described(1.0, 'on its strains', low=0.1, high=10.0)
    times: float = described(1.0, 'on its ramps and rests', low=0.1, high=10.0)
    speed: float = described(1.0, 'on the speed of a launch', low=0.1, high=10.0)


AS_SET = Trim()
"""The pulse in the settings."""

QUICKER = (
    Trim(1.0, 0.42),
    Trim(0.9, 0.3),
    Trim(0.8, 0.5),
    Trim(1.0, 0.5),
    Trim(0.8, 0.36),
    Trim(1.6, 0.42),
    Trim(0.9, 0.5),
    Trim(1.15, 0.42),
    Trim(0.7, 0.2),
    Trim(0.6, 0.36),
    Trim(1.3, 0.5),
    Trim(0.7, 0.42),
)
"""For cycles that ramp straight back, which are slow: in haste the wall swings over what holds it
half-way. Quicker still, cells at the right end slip into a third ground state."""

STRONGER = (
    Trim(1.5, 1.3),
    Trim(1.8, 1.3),
    Trim(2.2, 2.2),
    Trim(1.15, 1.0),
    Trim(1.5, 2.2),
    Trim(1.3, 1.0),
    Trim(0.8, 1.0),
    Trim(0.8, 1.3),
    Trim(0.9, 1.3),
    Trim(1.8, 2.2),
    Trim(1.0, 1.3),
    Trim(0.9, 2.2),
    Trim(2.2, 1.6),
    Trim(1.15, 1.3),
    Trim(1.15, 2.2),
    Trim(0.8, 1.6),
)
"""For cycles that ease the strain, which are as quick as an element allows that is as designed."""


LAUNCHES = (
    Trim(1.25, 0.3, 2.0),
    Trim(2.2, 0.3, 2.0),
    Trim(1.0, 0.3, 2.0),
    Trim(1.5, 0.5, 2.0),
    Trim(0.8, 0.5, 2.0),
    Trim(1.25, 0.3, 3.0),
    Trim(1.0, 1.0, 2.0),
)
"""For a launch that such a write begins with: with too slow a start the wall turns back."""


def menu(settings: Settings, level: int) -> tuple[Trim, ...]:
    """Return what is tried, in this order: each saves most of what those before leave.

    Args:
        settings: The instrument's.
        level: To which the wall is taken.
    """
    if not settings.write.ease:
        return (AS_SET, *QUICKER)
    return (AS_SET, *(STRONGER if level else LAUNCHES))


TIMES = ('ramp', 'hold', 'ease', 'release', 'settle')
"""What a trim makes longer or shorter, of `WriteSettings`."""

STRAINS = ('compression', 'tension', 'start_strain')
"""What a trim makes stronger or weaker, as far as the actuator goes."""


def trimmed(settings: Settings, trim: Trim) -> Settings:
    """Return settings with the pulse of one step for all."""
    limit, write = settings.actuator.max_strain, settings.write
    changed = {name: trim.times * getattr(write, name) for name in TIMES}
    changed['launch_speed'] = min(trim.speed * write.launch_speed, 10.0)
    for name in STRAINS:
        changed[name] = max(-limit, min(trim.peak * getattr(write, name), limit))
    return dataclasses.replace(settings, write=dataclasses.replace(write, **changed))


@dataclass(frozen=True)
class Trims:
    """What was learnt under one schedule.

    Attributes:
        steps: By the level to which a pulse takes the wall; the first is the launch.
        schedule: `schedule_of` the settings, with no others of which they mean anything.
    """

    steps: tuple[Trim, ...]
    schedule: str

    def as_dict(self) -> dict[str, Any]:
        """Return it for a file."""
        return {'steps': list(map(dataclasses.astuple, self.steps)), 'schedule': self.schedule}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Trims:
        """Return what `as_dict` gave.

        Raises:
            SettingsError: The data are no trims.
        """
        try:
            steps = tuple(Trim(peak, times, speed) for peak, times, speed in data['steps'])
            schedule = data['schedule']
        except (KeyError, TypeError, ValueError) as error:
            raise SettingsError(f'trims need steps and a schedule; {error!r}') from error
        if not isinstance(schedule, str):
            raise SettingsError(f'the schedule of trims must be a hash; got {clipped(schedule)}')
        return cls(steps, schedule)


def schedule_of(settings: Settings) -> str:
    """Return a hash of what makes the pulses of a write."""
    write, actuator = settings.write, settings.actuator
    values = [getattr(write, name) for name in (*TIMES, *STRAINS, 'ease_to', 'launch_speed')]
    values += [write.last_release, actuator.max_strain, actuator.max_rate]
    text = json.dumps(values)  # which writes every bit of a float
    return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()


def learnt(steps: Iterable[Trim], settings: Settings) -> Trims | None:
    """Return trims under a schedule, or None where all are as set."""
    steps = tuple(steps)
    return Trims(steps, schedule_of(settings)) if set(steps) != {AS_SET} else None
