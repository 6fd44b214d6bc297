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
from .trial import STEP, chance, outcomes, wanted

BATCH = 64
"""Levels of a point: so many small elements, or one of 64 levels."""


def batch(design: Design) -> int:
    """Return the number of elements of a point: a second of computing, or a few."""
    return max(1, BATCH // design.levels)


def common(design: Design, settings: Settings) -> dict[str, Any]:
    """Return what all points share."""
    return {'design': dataclasses.asdict(design), 'settings': settings.as_dict()}


def seeds(design: Design, seed: int) -> list[int]:
    """Return the seeds of the elements of a point: any one of them can be made again alone."""
    states = np.random.SeedSequence(seed).generate_state(batch(design), np.uint64)
    return [int(state) for state in states]


def evaluate(shared: Values, values: Values, seed: int) -> Row:
    """Return the counts of one point.

    Args:
        shared: What `common` returned.
        values: kind, scatter, and what is tried: `STEP` or an end that reads.
        seed: Of the batch.

    Returns:
        elements: How many were made.
        squares: Sum over them of the square of the number of their failures.
        silent: Reads, of all levels, that were decoded as another level.
        failed_L: How many failed to go from level L to the next, or to be decoded as L.
    """
    design, settings = Design(**shared['design']), Settings.from_dict(shared['settings'])
    by = chance(values['kind'], values['scatter'])
    failed = np.zeros(design.levels, dtype=int)
    squares = silent = 0
    for element_seed in seeds(design, seed):
        right = np.array(wanted(design, values['tried']))
        try:
            found = np.array(outcomes(design, settings, by, element_seed, values['tried']))
        except DesignError:  # so light a cell that the step is too long for it: lost altogether
            found = np.full(len(right), UNDECODABLE)
        wrong = found != right
        failed[: len(wrong)] += wrong
        squares += int(wrong.sum()) ** 2
        if values['tried'] != STEP:
            silent += int((wrong & (found != UNDECODABLE)).sum())
    counts = {f'failed_{level}': int(count) for level, count in enumerate(failed)}
    return {'elements': batch(design), 'squares': squares, 'silent': silent, **counts}
