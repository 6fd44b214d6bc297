# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which strokes and throws an individual element takes, and with which peaks.

Cells that scatter hold a wall where a stroke should free it, or let it run on. What was planned
for one element says from which levels each is made with another peak, or not at all.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..clipped import clipped
from .errors import SettingsError
from .settings import Settings

QUICK = ('down_even', 'down_odd', 'up_even', 'up_odd', 'throw')
"""The settings of strokes and throws."""

MOST_LEVELS = 100_000
"""Above every level that settings can name."""


@dataclass(frozen=True)
class QuickMoves:
    """What was planned for one element.

    Attributes:
        peaks: By the name of a stroke's or throw's settings, and by the level from which it
            begins: factor on its peak; 0: it is not used. All others are as set.
        schedule: `quick_schedule` of the settings; with others the factors are meaningless.
    """

    peaks: Mapping[str, Mapping[int, float]]
    schedule: str

    def __post_init__(self) -> None:
        given = [each for one in self.peaks.values() for each in one.items()]
        sound = all(0 <= level < MOST_LEVELS and 0.0 <= peak <= 2.0 for level, peak in given)
        if not sound or not set(self.peaks) <= set(QUICK):
            raise SettingsError(
                f'peaks must be of {", ".join(QUICK)}, from levels from 0, with factors from 0 '
                f'to 2; got {clipped(self.peaks)}'
            )

    def adapt(self, settings: Settings, start: int | None = None) -> Settings:
        """Return settings that bar what is not used, with the peaks for a move from the level
        `start`.
        """
        if self.schedule != quick_schedule(settings):
            return settings
        changed: dict[str, Any] = {}
        limit = settings.actuator.max_strain
        for name, peaks in self.peaks.items():
            group: Any = settings.groups()[name]
            barred = group.barred | {level for level, peak in peaks.items() if not peak}
            factor = 1.0 if start is None else peaks.get(start) or 1.0
            peak = max(-limit, min(factor * group.peak, limit))
            not_from = ' '.join(map(str, sorted(barred)))
            changed[name] = dataclasses.replace(group, peak=peak, not_from=not_from)
        return dataclasses.replace(settings, **changed)

    def as_dict(self) -> dict[str, Any]:
        """Return the values for a file."""
        peaks = {name: [list(each) for each in one.items()] for name, one in self.peaks.items()}
        return {'peaks': peaks, 'schedule': self.schedule}


def quick_schedule(settings: Settings) -> str:
    """Return a hash of all settings that shape strokes and throws."""
    groups: Any = settings.groups()
    values: list[Any] = [dataclasses.asdict(groups[name]) | {'not_from': ''} for name in QUICK]
    values += [settings.actuator.max_strain, settings.actuator.max_rate]
    return hashlib.blake2b(json.dumps(values).encode(), digest_size=16).hexdigest()
