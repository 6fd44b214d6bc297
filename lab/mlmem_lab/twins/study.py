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

from collections.abc import Callable, Iterable
from typing import Any

from mlmem.errors import ProcedureFailed

from ..study import Study
from .surveyed import HIDDEN_KINDS, summarise_fits, survey_element
from .watched import (
    CHANGE_KINDS,
    summarise_changed,
    summarise_healthy,
    watch_changed,
    watch_healthy,
)


def choose_scatter(preset: str) -> float:
    """Return the scatter of alpha, relative (s.d.), at which elements of a preset are counted.

    At 1 % strain does not erase `bits_4`; docs/limits.md says what it tolerates.
    """
    return 0.003 if preset == 'bits_4' else 0.01


def count_fits(case: str, seed: int) -> dict[str, Any]:
    """Return how fits of four elements of a preset and a kind of hidden element ended."""
    preset, _, kind = case.partition(', ')
    scatter, seeds = choose_scatter(preset), range(seed, seed + 4)
    rows = [survey_element(preset, scatter, each, kind) for each in seeds]
    return {**summarise_fits(rows), 'rows': rows}


def count_alarms(preset: str, seed: int) -> dict[str, Any]:
    """Return how often a twin of 40 elements reported a change where nothing changed."""
    scatter = choose_scatter(preset)
    rows, failed = watch_elements(
        lambda each: watch_healthy(preset, scatter, each), range(seed, seed + 40)
    )
    return {**summarise_healthy(rows), 'not calibrated': failed, 'rows': rows}


def count_changes(change: str, seed: int) -> dict[str, Any]:
    """Return what a twin of four elements reported of a change."""
    preset = 'bits_4'
    rows, failed = watch_elements(
        lambda each: watch_changed(preset, choose_scatter(preset), each, change),
        range(seed, seed + 4),
    )
    return {**summarise_changed(rows), 'not calibrated': failed, 'rows': rows}


def watch_elements(
    watch: Callable[[int], dict[str, Any]], seeds: Iterable[int]
) -> tuple[list[dict[str, Any]], list[str]]:
    """Return what was seen of the elements of some seeds, and why others could not be calibrated:
    a twin does not watch these.
    """
    rows, failed = [], []
    for seed in seeds:
        try:
            rows.append(watch(seed))
        except ProcedureFailed as failure:
            failed.append(str(failure))
    return rows, failed


twin_fits_study = Study(
    'twin_fits',
    count_fits,
    tuple(
        f'{preset}, {kind}' for preset in ('bits_1', 'bits_4', 'case_2') for kind in HIDDEN_KINDS
    ),
    # also what stands for the transducers, and for an element that is simulated otherwise
    ('mlmem_tools/identification', 'mlmem_tools/rig/emulated.py', 'lab/mlmem_lab/rk4.py',
     'lab/mlmem_lab/twins'),
    seed=81_400,  # none of these elements was used to make the fit
)  # fmt: skip
twin_alarms_study = Study(
    'twin_alarms', count_alarms, ('bits_4',), twin_fits_study.modules, seed=0
)
twin_changes_study = Study(
    'twin_changes', count_changes, tuple(CHANGE_KINDS), twin_fits_study.modules, seed=0
)
