# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Kicks of a register for one element: at which speeds walls and kinks come to every level."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache

import numpy as np

from mlmem.physics import Specimen
from mlmem.settings import Settings

from ..windows.flight import KICK_SPEEDS, Found, build_chain, middle_speed
from ..windows.words import STEP_KINDS, cases_ahead, kicked_behind


def search_words(
    made: Specimen, settings: Settings, report: Callable[[str, float], object] | None = None
) -> tuple[list[Found], list[Found]]:
    """Return the kicks of walls and of kinks to every level of an element.

    Each is the middle of the slowest range of speeds that is wide enough, or else of the widest,
    whatever rests ahead: see `windows.words.cases_ahead`. Kinks come to no level behind which no
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
                report(f'{STEP_KINDS[kind]} to level {level}', (kind + level / levels) / 2.0)
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
