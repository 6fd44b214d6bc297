# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Count what fits and twins of elements are worth, over elements that nobody has seen.

`twin_fits`: elements are surveyed and fitted. Are their cells inside the intervals, and how far
off are they? `twin_alarms`: a twin watches reads and writes of an element in which nothing
changes. How often does it report a change? `twin_changes`: a cell, the damping, the strain or a
gain changes. Is that reported, after how many reads, and how far off? Except in fits a twin knows
every alpha to 0.05 %. Nothing is discarded.
"""

from __future__ import annotations

from typing import Any

from ..study import Study
from .surveyed import HIDDEN_KINDS, summarise_fits, survey_element
from .watched import (
    CHANGE_KINDS,
    summarise_changed,
    summarise_healthy,
    watch_changed,
    watch_healthy,
)

ELEMENT_COUNT = 4
"""Elements of a case; ten times as many are watched in which nothing changes."""

SCATTER = 0.01
"""Of alpha, relative."""

FIRST_FIT_SEED = 81400
"""Seed of the first element that is fitted: none of them was used to make the fit."""

WATCHED_PRESET = 'bits_4'


def count_fits(case: str) -> dict[str, Any]:
    """Return how fits of a preset and a kind of hidden element ended."""
    preset, _, kind = case.partition(', ')
    seeds = range(FIRST_FIT_SEED, FIRST_FIT_SEED + ELEMENT_COUNT)
    rows = [survey_element(preset, SCATTER, seed, kind) for seed in seeds]
    return {**summarise_fits(rows), 'rows': rows}


def count_alarms(preset: str) -> dict[str, Any]:
    """Return how often a twin reported a change where nothing changed."""
    rows = [watch_healthy(preset, SCATTER, seed) for seed in range(10 * ELEMENT_COUNT)]
    return {**summarise_healthy(rows), 'rows': rows}


def count_changes(change: str) -> dict[str, Any]:
    """Return what a twin reported of a change."""
    rows = [watch_changed(WATCHED_PRESET, SCATTER, seed, change) for seed in range(ELEMENT_COUNT)]
    return {**summarise_changed(rows), 'rows': rows}


STUDIED_MODULES = (
    'mlmem_tools/identification', 'mlmem_tools/rig/emulated.py', 'lab/mlmem_lab/rk4.py',
    'lab/mlmem_lab/twins',
)  # fmt: skip
"""Also what stands for the transducers, and for an element that is simulated otherwise."""

twin_fits_study = Study(
    'twin_fits',
    count_fits,
    tuple(
        f'{preset}, {kind}' for preset in ('bits_1', 'bits_4', 'case_2') for kind in HIDDEN_KINDS
    ),
    STUDIED_MODULES,
    FIRST_FIT_SEED,
)
twin_alarms_study = Study('twin_alarms', count_alarms, (WATCHED_PRESET,), STUDIED_MODULES, 0)
twin_changes_study = Study('twin_changes', count_changes, tuple(CHANGE_KINDS), STUDIED_MODULES, 0)
