# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One point of a tolerance study: a batch of elements with one kind of chance, counted."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from ...device import UNDECODABLE, Settings
from ...physics import Design, DesignError
from ..campaign import Row
from ..campaign.campaign import Values
from .trial import ENDS, ElementTrial, chance, try_element

BATCH = 10
"""Elements of a point: about a second of computing with the paper's element."""


def common(design: Design, settings: Settings) -> dict[str, Any]:
    """Return what all points share."""
    return {'design': dataclasses.asdict(design), 'settings': settings.as_dict()}


def seeds(seed: int) -> list[int]:
    """Return the seeds of the elements of a point: any one of them can be made again alone."""
    return [int(state) for state in np.random.SeedSequence(seed).generate_state(BATCH, np.uint64)]


def evaluate(shared: Values, values: Values, seed: int) -> Row:
    """Return the counts of one point.

    Args:
        shared: What `common` returned.
        values: kind and scatter.
        seed: Of the batch.

    Returns:
        elements: How many were made.
        step_L: How many failed to go from level L to the next.
        END_L: How many were decoded from an end, with the wall at level L, as another level
            or not at all.
        silent_END: Of all these, how many as another level.
    """
    design, settings = Design(**shared['design']), Settings.from_dict(shared['settings'])
    by = chance(values['kind'], values['scatter'])
    counts = dict.fromkeys(columns(design.levels), 0)
    for element_seed in seeds(seed):
        try:
            trial = try_element(design, settings, by, element_seed)
        except DesignError:  # so light a cell that the step is too long for it: lost altogether
            lost = (False,) * (design.levels - 1)
            trial = ElementTrial(lost, dict.fromkeys(ENDS, (UNDECODABLE,) * design.levels))
        for level, stepped in enumerate(trial.stepped):
            counts[f'step_{level}'] += not stepped
        for end, read in trial.read.items():
            for level, decoded in enumerate(read):
                counts[f'{end}_{level}'] += decoded != level
                counts[f'silent_{end}'] += decoded not in (level, UNDECODABLE)
    return {'elements': BATCH, **counts}


def columns(levels: int) -> list[str]:
    """Return the names of the counts."""
    return [
        *(f'step_{level}' for level in range(levels - 1)),
        *(f'{end}_{level}' for end in ENDS for level in range(levels)),
        *(f'silent_{end}' for end in ENDS),
    ]
