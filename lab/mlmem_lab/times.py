# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How long procedures take, and what reads do to the wall.

Every preset makes random writes in a row, and a thousand reads of a level, which may move the
wall. Times are in time units.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from mlmem import MemoryElement, Read, Write, load_element
from mlmem.physics import find_level, find_walls

from .results import list_strained_presets
from .study import Study


def measure_times(name: str, seed: int) -> dict[str, Any]:
    """Return the times of a preset, and the read disturb."""
    random = np.random.default_rng(seed)
    design, settings = load_element(name).design_and_settings
    element = MemoryElement(design, settings)
    automatic = replace(settings, write=replace(settings.write, method='auto'))
    result = {
        **_time_writes(element, random),
        'auto': _time_writes(MemoryElement(design, automatic), random),
    }
    reads, shift = [], 0.0
    read_count = 1000
    for level in range(0, design.levels, max(1, design.levels // 8)):
        element.perform(Write(level))
        before = _settle_wall(element)
        reads += [_time_read(element) for _ in range(read_count)]
        shift = max(shift, abs(_settle_wall(element) - before))
    return result | {'read': _summarise_times(reads), 'read disturb': shift}


def _time_writes(element: MemoryElement, random: np.random.Generator) -> dict[str, Any]:
    """Return the times of a hundred random writes in a row, and how many went wrong."""
    count = 100
    levels = element.design.levels
    times: dict[str, list[float]] = {'up': [], 'down': []}
    before = 0
    wrong = failed = again = 0
    element.perform(Write(before))
    for _ in range(count):
        level = int((before + random.integers(1, levels)) % levels)
        outcome = element.perform(Write(level))
        time = (outcome.end_tick - outcome.start_tick) * element.tick
        times['up' if level > before else 'down'].append(time)
        there = find_level(element.design, element.chain.configuration) == level
        wrong += outcome.success and not there
        failed += not outcome.success
        again += outcome.attempts > 1
        before = level
    counts = {'writes': count, 'wrong': wrong, 'failed': failed, 'second attempts': again}
    every = {'all': times['up'] + times['down'], **times}
    return counts | {way: _summarise_times(some) for way, some in every.items()}


def _time_read(element: MemoryElement) -> float:
    outcome = element.perform(Read())
    if not outcome.success:
        raise RuntimeError(f'a read failed: {outcome.error}')
    return (outcome.end_tick - outcome.start_tick) * element.tick


def _settle_wall(element: MemoryElement) -> float:
    """Return where the wall is once it no longer swings in its well."""
    settle_runs = 20  # runs of 50 ticks: 80 damping times
    for _ in range(settle_runs):
        element.advance(50)
    (wall,) = find_walls(element.design, element.chain.configuration)
    return wall.position


def _summarise_times(times: Iterable[float]) -> dict[str, float]:
    some = np.fromiter(times, float)
    seconds = 1e-4  # of a time unit at the default scale
    return {
        'median': float(np.median(some)),
        'least s': float(some.min()) * seconds,
        'most s': float(some.max()) * seconds,
    }


times_study = Study(
    'times',
    measure_times,
    tuple(name for name in list_strained_presets() if name != 'case_1'),  # which has one level
    ('lab/mlmem_lab/times.py',),
    seed=1,
)
