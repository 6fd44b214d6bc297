# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Count what fits and twins of elements are worth, over elements that nobody has seen.

fits: elements are surveyed and fitted. Are their cells inside the intervals, and how far off are
they? healthy: a twin watches reads and writes of an element in which nothing changes. How often
does it report a change? changes: a cell, the damping, the strain or a gain changes. Is that
reported, after how many reads, and how far off? Except in fits a twin knows every alpha to 0.05 %.
Nothing is discarded.
"""

from __future__ import annotations

from collections.abc import Mapping
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

PARTS = ('fits', 'healthy', 'changes')
ELEMENT_COUNT = 4
"""Elements of a kind; ten times as many are watched in which nothing changes."""

SCATTER = 0.01
"""Of alpha, relative."""


FITTED_PRESETS = ('bits_1', 'bits_4', 'case_2')
WATCHED_PRESET = 'bits_4'


def count_elements(case: str) -> dict[str, Any]:
    """Return the entry of a case: its part, preset, and kind or change."""
    part, preset, *rest = case.split(', ', 2)
    entry: dict[str, Any] = {'preset': preset, 'scatter': SCATTER}
    # of the elements that are fitted: none of these was used to make the fit
    first_fit_seed = 81400
    if part == 'fits':
        entry['kind'] = rest[0]
        seeds = range(first_fit_seed, first_fit_seed + ELEMENT_COUNT)
        rows = [survey_element(preset, SCATTER, seed, rest[0]) for seed in seeds]
        return entry | {'seed': seeds[0], **summarise_fits(rows), 'rows': rows}
    if part == 'healthy':
        rows = [watch_healthy(preset, SCATTER, seed) for seed in range(10 * ELEMENT_COUNT)]
        return entry | {'seed': 0, **summarise_healthy(rows), 'rows': rows}
    entry['change'] = rest[0]
    rows = [watch_changed(preset, SCATTER, seed, rest[0]) for seed in range(ELEMENT_COUNT)]
    return entry | {'seed': 0, **summarise_changed(rows), 'rows': rows}


def add_entry(kept: Mapping[str, Any], case: str, entry: Any) -> dict[str, Any]:
    """Return the entries of all parts, in the order of the cases."""
    parts = {part: {name_case(part, one): one for one in kept.get(part, ())} for part in PARTS}
    parts[case.partition(',')[0]][case] = entry
    return {
        part: [entries[each] for each in STUDY.cases if each in entries]
        for part, entries in parts.items()
    }


def name_case(part: str, entry: Mapping[str, Any]) -> str:
    """Return the case of an entry."""
    what = entry.get('kind') or entry.get('change')
    return ', '.join([part, entry['preset'], *([what] if what else [])])


STUDY = Study(
    'twin',
    count_elements,
    (
        *(f'fits, {preset}, {kind}' for preset in FITTED_PRESETS for kind in HIDDEN_KINDS),
        f'healthy, {WATCHED_PRESET}',
        *(f'changes, {WATCHED_PRESET}, {change}' for change in CHANGE_KINDS),
    ),
    ('mlmem_tools/identification', 'lab/mlmem_lab/twins'),
    add=add_entry,
)
