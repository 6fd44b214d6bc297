# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The study: at which amounts of what is random one in a thousand fails.

A case such as `case_2 alpha step 200` names an element (or its file), what is random, what is
tried, and after how many trials of an amount counting stops, however few have failed.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

from mlmem import load_element

from ...study import Study
from .curve import count_curve, describe_rare_amount
from .draw import draw_rates
from .element import ALL_KINDS, KICK_TRIAL, TRIAL_LABELS, WORD_TRIALS, split_kinds


def list_studied_cases() -> tuple[str, ...]:
    """Return the cases of the study."""
    # what is random, by element, what is tried, and the most trials of an amount
    studied_kinds = {
        ('bits_2', 'step', 200): 'alpha s offset',
        ('case_2', 'step', 200): 'alpha s offset k_r',
        ('case_2', 'kick', 2000): 'alpha offset k_r mass',
        ('bits_4', 'step', 200): 'alpha s offset k_r',
        ('kick_2', 'kick', 2000): 'alpha offset k_r mass',
        ('kick_4', 'kick', 2000): 'alpha offset k_r mass',
        ('byte', 'word', 600): 'alpha k_r offset mass damping',
        ('byte', 'hear', 1200): 'alpha noise',
        ('register_4', 'word', 600): 'alpha k_r offset mass damping',
    }
    return tuple(
        f'{element} {kind} {tried} {most}'
        for (element, tried, most), kinds in studied_kinds.items()
        for kind in kinds.split()
    )


def list_cases(
    element: str, kinds: Sequence[str], trials: Sequence[str], most: int
) -> tuple[str, ...]:
    """Return the cases of an element.

    Raises:
        ValueError: There is no such element, kind or trial, or the element has no such move.
    """
    design, settings = load_element(element).design_and_settings
    parts = {part for kind in kinds for part in split_kinds(kind)}
    if unknown := sorted(parts - set(ALL_KINDS)):
        raise ValueError(f'kinds must be of {", ".join(ALL_KINDS)}; got {", ".join(unknown)}')
    if unknown := sorted(set(trials) - set(TRIAL_LABELS)):
        raise ValueError(f'tried must be of {", ".join(TRIAL_LABELS)}; got {", ".join(unknown)}')
    kicked = settings.kick.wall_speeds
    if KICK_TRIAL in trials and not (len(kicked) == design.levels and all(kicked)):
        raise ValueError('tried can be kick only where every level has one (kick.speeds)')
    if set(WORD_TRIALS) & set(trials) and not settings.holds_words:
        raise ValueError(
            f'tried can be {", ".join(WORD_TRIALS)} only in a register (register.spacing)'
        )
    if most < 1:
        raise ValueError(f'most must be at least 1; got {most}')
    return tuple(f'{element} {kind} {tried} {most}' for kind in kinds for tried in trials)


def count_case(case: str, seed: int) -> dict[str, Any]:
    """Return the counts of a case, and the amount at which one in a thousand fails.

    Returns:
        amount: That amount with its interval; None if the counts determine none.
        text: The same in words.
        rows: See `count_curve`.
    """
    element, kind, tried, most = case.rsplit(' ', 3)
    rows = count_curve(*load_element(element).design_and_settings, kind, tried, int(most), seed)
    amount, text = describe_rare_amount(rows, seed)
    return {'amount': amount, 'text': text, 'rows': rows}


tolerance_study = Study(
    'tolerance',
    count_case,
    list_studied_cases(),
    tuple(
        f'lab/mlmem_lab/studies/{name}.py'
        for name in (
            'tolerance/curve',
            'tolerance/element',
            'tolerance/estimate',
            'tolerance/study',
            'trace',
        )
    ),
    0,
    draw=partial(
        draw_rates,
        cases=[f'case_2 {kind} step 200' for kind in ('alpha', 's', 'offset', 'k_r')],
    ),
)
