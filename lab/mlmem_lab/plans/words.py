# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Kicks of a register for one element: at which speeds walls and kinks come to every level."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cache

import numpy as np

from mlmem_ros.device.settings import Settings
from mlmem_ros.physics import Specimen
from mlmem_ros.physics.potential import Array

from ..windows.flight import ENOUGH, SPEEDS, Found, bare
from ..windows.words import KINDS, ahead, kicked_behind

REACH = 2.5
"""Most by which a speed may differ from that in the settings."""


def search_words(
    made: Specimen, settings: Settings, report: Callable[[str, float], object] | None = None
) -> tuple[list[Found], list[Found]]:
    """Return the kicks of walls and of kinks to every level of an element.

    Each is the middle of the slowest range of speeds that is wide enough, or else of the widest,
    whatever rests ahead: see `windows.words.ahead`. Kinks come to no level behind which no wall
    may rest.
    """
    chain, levels = bare(made, settings), made.design.levels

    @cache
    def after(walls: tuple[int, ...], speed: float) -> tuple[int, ...] | None:
        return kicked_behind(chain, settings.kick, walls, speed)

    found = list[list[Found]]()
    speeds = SPEEDS[settings.kick.fastest * SPEEDS <= settings.transducer.max_speed]
    for kind, shipped in enumerate((settings.kick.by_level, settings.kick.of_kinks)):
        found.append([])
        for level in range(levels):
            if report is not None:
                report(f'{KINDS[kind]} to level {level}', (kind + level / levels) / 2.0)
            cases = ahead(levels, settings.register.spacing, level, kind)
            if not cases:
                break
            cases.sort(key=lambda each: (len(each), *(-wall for wall in each)))  # common ones
            good = [
                abs(math.log(speed / shipped[level])) <= math.log(REACH)
                and all(after(each, speed) == (level, *each) for each in cases)
                for speed in map(float, speeds)
            ]
            found[kind].append(_middle(speeds, good))
    return found[0], found[1]


def _middle(speeds: Array, good: Sequence[bool]) -> Found:
    """Return the slowest range of good speeds that is wide enough, or else the widest."""
    best, there = Found(), np.flatnonzero(good)
    for run in np.split(there, np.flatnonzero(np.diff(there) > 1) + 1) if there.size else ():
        low, high = speeds[run[0]], speeds[run[-1]]
        found = Found(float(f'{math.sqrt(low * high):.4g}'), round(math.sqrt(high / low) - 1.0, 3))
        if found.room >= ENOUGH:
            return found
        best = max(found, best, key=lambda each: each.room)
    return best
