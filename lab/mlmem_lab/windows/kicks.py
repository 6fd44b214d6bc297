# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Measure kicks, how exact their speeds must be, and count writes without strain.

Every kick starts from a blank element at rest, one that erases from a level, on a bare chain as
the device steps it. Then the device writes random levels, any to any, and the true wall is
compared with each answer.
"""

from __future__ import annotations

import random
from collections.abc import Mapping
from statistics import median
from typing import Any

import numpy as np

from mlmem import Erase, MemoryElement, Write, load_element
from mlmem.element_file import use_kicks
from mlmem.physics import Specimen, find_level
from mlmem.physics.wall import arrival_tolerance
from mlmem.readers.reading import BLANK
from mlmem_tools.identification.kick_search import (
    KICK_SPEEDS,
    after_erase,
    after_kick,
    build_chain,
    find_speed_edge,
)

from ..studies import style
from ..study import Study


def measure_kicks(name: str, seed: int) -> dict[str, Any]:
    """Return where kicks of a preset end, how far speeds may be off, and the count of writes."""
    design, settings = load_element(name).design_and_settings
    chain, shape = build_chain(Specimen(design), settings), settings.kick
    ends = [after_kick(chain, float(u), shape) for u in KICK_SPEEDS]
    levels = []
    for level, speed in enumerate(shape.wall_speeds):

        def leads_there(speed: float, level: int = level) -> bool:
            return after_kick(chain, speed, shape) == level

        low, high = (find_speed_edge(leads_there, speed, step) for step in (1.0 / 1.04, 1.04))
        levels.append({
            'level': level, 'speed': speed, 'low': round(low, 5), 'high': round(high, 5),
            'room': round(min(speed / low, high / speed) - 1.0, 3),
        })  # fmt: skip
    speeds, shares = KICK_SPEEDS[::5], []
    for speed in speeds.tolist():
        contents = [after_erase(chain, level, speed, shape) for level in range(design.levels)]
        shares.append(float(np.mean(np.array(contents) == BLANK)))
    return {
        'speeds': KICK_SPEEDS.round(5),
        'ends': ends,
        'levels': levels,
        'erased': {'speeds': speeds.round(5), 'shares': shares},
        'written': count_writes(name, 2000, seed),
    }


def count_writes(name: str, procedures: int, seed: int) -> dict[str, Any]:
    """Write random levels, every tenth procedure an erase; compare with the true wall."""
    element, rng = MemoryElement(use_kicks(load_element(name))), random.Random(seed)
    levels = range(element.design.levels)
    near, present = arrival_tolerance(element.design), BLANK
    ticks, erased = list[int](), list[int]()
    wrong = failed = again = strained = 0
    for k in range(1, procedures + 1):
        before = element.actuator.motion
        if k % 10:
            wanted = rng.choice([level for level in levels if level != present])
            outcome = element.perform(Write(wanted))
        else:
            wanted, outcome = BLANK, element.perform(Erase())
        (ticks if wanted != BLANK else erased).append(outcome.end_tick - outcome.start_tick)
        present = find_level(element.design, element.chain.configuration, near)
        failed += not outcome.success
        wrong += outcome.success and present != wanted
        again += outcome.attempts > 1
        strained += element.actuator.motion is not before
    return {
        'writes': len(ticks), 'erases': len(erased), 'wrong': wrong, 'failed': failed,
        'again': again, 'strained': strained, 'median': median(ticks),
        'ninth': sorted(ticks)[len(ticks) * 9 // 10], 'longest': max(ticks),
        'erase': median(erased), 'tick': element.tick,
    }  # fmt: skip


def draw_kicks(result: Mapping[str, Any]) -> Any:
    """Draw the level over the speed of a kick, and the share of levels that a kick erases."""
    figure = style.new_figure(3.4)
    left, right = style.axes_grid(figure, 1, 2, width_ratios=(1.5, 1.0))[0]
    for name, found in result['cases'].items():
        speeds, ends = np.array(found['speeds']), np.array(found['ends'])
        some = ends >= 0
        left.plot(speeds[some], ends[some], '.', markersize=3, label=name)
        shipped = [(each['speed'], each['level']) for each in found['levels']]
        left.plot(*zip(*shipped, strict=True), 'k|', markersize=7)
        shares = 100.0 * np.array(found['erased']['shares'])
        right.plot(
            found['erased']['speeds'], shares, '.-', markersize=3, linewidth=0.5, label=name
        )
    left.set(xscale='log', xlabel='mean speed of the kick, cells per time unit', ylabel='level')
    right.set(xscale='log', xlabel='mean speed of the kick', ylabel='levels erased, %')
    left.legend()
    style.label_panel(left, 'a', 'kicked from blank')
    style.label_panel(right, 'b', 'kicked out')
    return figure


kicks_study = Study(
    'kicks',
    measure_kicks,
    ('kick_2', 'case_2', 'kick_4'),
    (
        'lab/mlmem_lab/windows/kicks.py',
        'mlmem/element_file.py',
        'mlmem_tools/identification/kick_search.py',
    ),
    0,
    draw=draw_kicks,
)
