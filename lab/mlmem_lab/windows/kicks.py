# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Measure kicks, how exact they must be, and count writes without strain.

Every kick starts from a blank element at rest, one that erases from a level, on a bare chain as
the device steps it. For each kick that ships, every quantity is off until the kick fails. Then the
device writes random levels, any to any, and the true wall is compared with each answer.
"""

from __future__ import annotations

import random
from collections.abc import Mapping
from dataclasses import replace
from statistics import median
from typing import Any

import numpy as np

from mlmem import Erase, MemoryElement, Write, preset
from mlmem.physics import Specimen, find_level
from mlmem.physics.wall import arrival_tolerance
from mlmem.presets import use_kicks
from mlmem.readers.reading import BLANK

from ..studies import style
from ..study import Study
from .flight import (
    KICK_SPEEDS,
    after_erase,
    after_kick,
    build_chain,
    erase_margins,
    kick_margins,
    speed_edge,
)

PROCEDURE_COUNT = 2000
"""Random procedures of each preset."""

PROCEDURES_PER_ERASE = 10
"""Every so many procedures is an erase."""

SEED = 0

ERASE_SPEEDS = KICK_SPEEDS[::5]
"""Mean speeds of kicks that erase."""


def measure_kicks(name: str) -> dict[str, Any]:
    """Return where kicks of a preset end, how far each may be off, and the count of writes."""
    design, settings = preset(name)
    chain, shape = build_chain(Specimen(design), settings), settings.kick
    ends = np.array([after_kick(chain, float(u), shape) for u in KICK_SPEEDS])
    levels = []
    for level, speed in enumerate(shape.wall_speeds):
        at = int(np.argmin(np.abs(KICK_SPEEDS - speed)))
        low, high = (
            speed_edge(chain, shape, level, KICK_SPEEDS, ends, at, way) for way in (-1, 1)
        )
        levels.append({
            'level': level, 'speed': speed, 'low': round(low, 5), 'high': round(high, 5),
            'room': round(min(speed / low, high / speed) - 1.0, 3),
            'rooms': kick_margins(chain, level, shape),
        })  # fmt: skip
    shares = []
    for speed in ERASE_SPEEDS.tolist():
        kick = replace(shape, erase_speed=speed)
        erased = [after_erase(chain, level, kick) == BLANK for level in range(design.levels)]
        shares.append(float(np.mean(erased)))
    return {
        'speeds': KICK_SPEEDS.round(5),
        'ends': ends,
        'levels': levels,
        'erases': [erase_margins(chain, level, shape) for level in range(design.levels)],
        'erased': {'speeds': ERASE_SPEEDS.round(5), 'shares': shares},
        'written': count_writes(name, PROCEDURE_COUNT, SEED),
    }


def count_writes(name: str, procedures: int, seed: int) -> dict[str, Any]:
    """Write random levels, any to any, with an erase now and then; compare with the true wall."""
    element, rng = MemoryElement(use_kicks(preset(name))), random.Random(seed)
    levels = range(element.design.levels)
    near = arrival_tolerance(element.design)
    present = BLANK
    ticks: list[int] = []
    erased: list[int] = []
    wrong = failed = again = strained = 0
    for k in range(1, procedures + 1):
        before = element.actuator.motion
        if k % PROCEDURES_PER_ERASE:
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
    for name, found in result['presets'].items():
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


STUDY = Study(
    'kicks',
    measure_kicks,
    ('kick_2', 'case_2', 'kick_4'),
    ('lab/mlmem_lab/windows/kicks.py', 'lab/mlmem_lab/windows/flight.py'),
    SEED,
    draw=draw_kicks,
)
