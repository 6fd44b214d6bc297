# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Kicks of a register for one element: at which speeds walls and kinks come to every level."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache

import numpy as np

from mlmem.move_settings import KickSettings
from mlmem.physics import Chain, Specimen, StateError
from mlmem.readers.register import find_wall_levels, pin_walls
from mlmem.settings import Settings

from .kick_search import KICK_SPEEDS, Found, build_chain, build_kick, drive_end, middle_speed


def cases_ahead(levels: int, spacing: int, level: int, kind: int) -> list[tuple[int, ...]]:
    """Return what may rest to the right of a wall (kind 0) or kink (1) at a level."""
    near = [tuple(range(level + spacing, levels, spacing)[:count]) for count in range(4)]
    far = [(levels - 1,)] if level + spacing < levels else []
    return sorted({each for each in (*near, *far) if len(each) % 2 == kind})


def kicked_behind(
    chain: Chain, shape: KickSettings, walls: tuple[int, ...], speed: float
) -> tuple[int, ...] | None:
    """Return the levels of all walls after a kick behind some at rest; None if a wall is at none,
    or these do not rest.
    """
    design = chain.design
    try:
        chain.place(pin_walls(chain.specimen, walls))
    except StateError:
        return None
    drive_end(chain, build_kick(chain, speed, shape))
    return find_wall_levels(design, chain.configuration)


def search_words(
    made: Specimen, settings: Settings, report: Callable[[str, float], object] | None = None
) -> tuple[list[Found], list[Found]]:
    """Return the kicks of walls and of kinks to every level of an element.

    Each is the middle of the slowest range of speeds that is wide enough, or else of the widest,
    whatever rests ahead: see `cases_ahead`. Kinks come to no level behind which no
    wall may rest.
    """
    chain, levels = build_chain(made, settings), made.design.levels

    @cache
    def walls_after_kick(walls: tuple[int, ...], speed: float) -> tuple[int, ...] | None:
        return kicked_behind(chain, settings.kick, walls, speed)

    found = list[list[Found]]()
    speeds = KICK_SPEEDS[
        settings.kick.peak_speed_ratio * KICK_SPEEDS <= settings.transducer.max_speed
    ]
    max_speed_factor = 2.5  # most by which a speed may differ from that in the settings
    for kind, shipped in enumerate((settings.kick.wall_speeds, settings.kick.kink_speeds)):
        found.append([])
        for level in range(levels):
            if report is not None:
                report(f'{("wall", "kink")[kind]} to level {level}', (kind + level / levels) / 2.0)
            cases = cases_ahead(levels, settings.register.spacing, level, kind)
            if not cases:
                break
            cases.sort(key=lambda each: (len(each), *(-wall for wall in each)))  # common ones
            good = [
                abs(math.log(speed / shipped[level])) <= math.log(max_speed_factor)
                and all(walls_after_kick(each, speed) == (level, *each) for each in cases)
                for speed in map(float, speeds)
            ]
            there = np.flatnonzero(good)
            found[kind].append(middle_speed(there, lambda at, _: float(speeds[at])))
    return found[0], found[1]
