# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Strokes and a throw for a design: by a law of the site and closed forms, or by search."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mlmem_ros.device import Settings
from mlmem_ros.device.strokes import actuator, by_9, throw
from mlmem_ros.physics import Design

from ..landscapes.throws import reach, shortest_ease
from .stroke_search import MoveTask, search

EASE_TO = -0.1
PEAK = 0.135
"""Of a throw: nine tenths of what the actuators of the presets give."""

FAR = 2.3
"""`reach` from which a throw takes the wall out."""

WIDE = 1.4
"""Least ratio of the release time too slow for that reach to that too fast for the cells."""

BETWEEN = 0.4
"""Where a throw's time lies between the two, as an exponent: 0 is too fast, 1 too slow."""

LONG = 225
"""Number of cells from which far walls need repeated pulses, of falling strength."""

SAMPLE = 5
"""Most levels that a search begins from."""


def going_back(design: Design, settings: Settings) -> Settings:
    """Return settings with strokes and a throw, as far as a law or a window is known.

    Peaks of strokes fall with the site by the law of nine cells to a level. A throw's release time
    lies between too fast for the far end and too slow for the wall.
    """
    usual = design.J == 9 and design.eta == 1 / 250
    back: dict[str, Any] = by_9(design.levels, design.N, design.eta) if usual else {}
    change = (1.0 - EASE_TO) * PEAK
    fast, slow = shortest_ease(design, change), reach(design, change, 1.0) / FAR
    if slow >= WIDE * fast:
        more: dict[str, Any] = {'mirrored': 0.8, 'levels': 10} if design.N > LONG else {}
        ease = float(round(fast * (slow / fast) ** BETWEEN))
        back['throw'] = throw(PEAK, 400.0, ease, EASE_TO, 700.0, **more)
        back['erase'] = replace(settings.erase, method='pulse')
    if back:
        back['actuator'] = actuator(design.N)
    return replace(settings, **back)


def searched(design: Design, settings: Settings, trials: int) -> Settings:
    """Return settings with the best strokes down and throw found by search from theirs.

    A move that the settings lack is not sought.

    Raises:
        ImportError: The package cmaes is missing.
    """
    last = design.levels - 1
    found: dict[str, Any] = {}
    starts = {
        'down_even': range(0, last + 1, 2), 'down_odd': range(1, last + 1, 2),
        'throw': range(last + 1),
    }  # fmt: skip
    for name, levels in starts.items():
        begin = getattr(settings, name)
        if begin.peak:
            lowest = 0 if name == 'throw' else max(begin.lowest, begin.levels)
            task = MoveTask(design, _some([each for each in levels if each >= lowest]))
            found[name] = search(task, begin, trials=trials, tick=settings.time.tick)
    return replace(settings, **found)


def _some(levels: Sequence[int]) -> list[int]:
    """Return as many of the levels as are tried, first and last among them."""
    places = np.linspace(0, len(levels) - 1, min(SAMPLE, len(levels)))
    return [levels[round(place)] for place in places]
