# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One point of a tolerance study: a batch of elements with one kind of chance, counted."""

from __future__ import annotations

import dataclasses
from functools import lru_cache
from typing import Any

import numpy as np

from ...device import UNDECODABLE, Settings
from ...physics import Design, DesignError, scattered
from ..campaign import Row
from ..campaign.campaign import Values
from .forecast import FORESEEN, Forecast
from .screen import DRAWN, weights
from .trial import STEP, chance, outcomes, wanted

BATCH = 64
"""Levels of a point: so many small elements, or one of 64 levels."""


def screened(shared: Values, kind: str, tried: str) -> bool:
    """Return whether a forecast tells which trials are simulated."""
    return bool(shared['screen']) and tried == STEP and kind in FORESEEN


def batch(design: Design, *, screen: bool) -> int:
    """Return the number of elements of a point: a second of computing, or a few."""
    return max(1, BATCH // design.levels) * (DRAWN if screen else 1)


def common(design: Design, settings: Settings, *, screen: bool) -> dict[str, Any]:
    """Return what all points share."""
    return {
        'design': dataclasses.asdict(design), 'settings': settings.as_dict(), 'screen': screen
    }  # fmt: skip


def seeds(count: int, seed: int) -> list[int]:
    """Return the seeds of the elements of a point: any one of them can be made again alone."""
    return [int(s) for s in np.random.SeedSequence(seed).generate_state(count, np.uint64)]


def evaluate(shared: Values, values: Values, seed: int) -> Row:
    """Return the counts of one point.

    Args:
        shared: What `common` returned.
        values: kind, scatter, and what is tried: `STEP` or an end that reads.
        seed: Of the batch.

    Returns:
        elements: How many were made.
        simulated: How many trials were simulated; the screen knows the others.
        squares: Sum over the elements of the square of the number of their failures.
        silent: Reads, of all levels, that were decoded as another level.
        failed_L: How many failed to go from level L to the next, or to be decoded as L.
    """
    design, settings = Design(**shared['design']), Settings.from_dict(shared['settings'])
    kind, tried = values['kind'], values['tried']
    by, right = chance(kind, values['scatter']), np.array(wanted(design, tried))
    screen = screened(shared, kind, tried)
    elements = batch(design, screen=screen)
    failed = np.zeros(design.levels)
    squares, silent, simulated = 0.0, 0, 0
    for one in seeds(elements, seed):
        counts = np.ones(len(right))
        if screen:
            specimen = scattered(design, by.scatter, one)
            counts = weights(_forecast(design, settings), specimen, len(right), one)
        levels = np.flatnonzero(counts)
        if len(levels) == 0:
            continue
        try:
            found = np.array(outcomes(design, settings, by, one, tried, levels.tolist()))
        except DesignError:  # so light a cell that the step is too long for it: lost altogether
            found = np.full(len(levels), UNDECODABLE)
        wrong = found != right[levels]
        failed[levels] += wrong * counts[levels]
        squares += float(np.sum(counts[levels][wrong])) ** 2
        simulated += len(levels)
        if tried != STEP:
            silent += int(np.sum(wrong & (found != UNDECODABLE)))
    named = {f'failed_{level}': float(count) for level, count in enumerate(failed)}
    return {
        'elements': elements, 'simulated': simulated, 'squares': squares, 'silent': silent, **named
    }  # fmt: skip


@lru_cache(maxsize=1)
def _forecast(design: Design, settings: Settings) -> Forecast:
    return Forecast(design, settings)
