# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The study of the pages: at which amounts of what is random one in a thousand fails."""

from __future__ import annotations

from functools import partial
from typing import Any

from mlmem import load_element

from ...study import Study
from .case import Case, split_case
from .curve import SEED, count_curve, describe_rare_amount
from .draw import draw_rates

STUDIED_KINDS = {
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
"""What is random, by element, what is tried, and the most trials of an amount."""

CASES = tuple(
    str(Case(element, kind, tried, most))
    for (element, tried, most), kinds in STUDIED_KINDS.items()
    for kind in kinds.split()
)


def count_case(name: str) -> dict[str, Any]:
    """Return the counts of a case, and the amount at which one in a thousand fails.

    Returns:
        amount: That amount with its interval; None if the counts determine none.
        text: The same in words.
        rows: See `count_curve`.
    """
    case = split_case(name)
    chosen = load_element(case.element).design_and_settings
    rows = count_curve(*chosen, case.kind, case.tried, case.most)
    amount, text = describe_rare_amount(rows)
    return {'amount': amount, 'text': text, 'rows': rows}


STUDY = Study(
    'tolerance',
    count_case,
    CASES,
    tuple(
        f'lab/mlmem_lab/studies/tolerance/{name}.py' for name in ('curve', 'element', 'estimate')
    ),
    SEED,
    draw=partial(
        draw_rates,
        cases=[case for case in CASES if case.startswith('case_2 ') and ' step ' in case],
    ),
)
