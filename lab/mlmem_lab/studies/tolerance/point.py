# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One point of a tolerance study: a batch of elements with one kind of randomness, counted."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from mlmem_ros.device import UNDECODABLE, Settings
from mlmem_ros.outside import decode
from mlmem_ros.physics import Design, DesignError, scattered
from mlmem_ros.physics.potential import Array
from mlmem_ros.rng import Stream, generator

from ..campaign import Row
from ..campaign.campaign import Values
from .element import STEP, chance, outcomes, wanted
from .particle import DRAWN, FORESEEN, StepForecast, weights

BATCH = 64
"""Levels per point: several small elements, or one tried at 64 levels."""


def screened(shared: Values, kind: str, tried: str) -> bool:
    """Return whether a forecast chooses which trials to simulate."""
    return bool(shared['screen']) and tried == STEP and kind in FORESEEN


def size(shared: Values, kind: str, tried: str) -> tuple[int, int]:
    """Return the number of elements of a point, and of trials of each; seconds of computing."""
    each = len(wanted(Design(**shared['design']), tried))
    if shared['levels']:
        each = min(each, shared['levels'])
    return max(1, BATCH // each) * (DRAWN if screened(shared, kind, tried) else 1), each


@dataclass(frozen=True)
class TriedElement:
    """The trials of one element.

    Attributes:
        seed: Reproduces this element alone.
        levels: The levels stepped from, or read, rising: all, or a random sample.
        counts: Weight of a failure of each; 0 if the screen left it out.
        found: The results, see `outcomes`; the expected one where left out.
        wrong: Whether each result differs from the expected one.
    """

    seed: int
    levels: NDArray[np.int_]
    counts: Array
    found: NDArray[np.int_]
    wrong: NDArray[np.bool_]


def elements(shared: Values, values: Values, seed: int) -> Iterator[TriedElement]:
    """Make the elements of a point and try each.

    `shared` is that of `Tolerance`, the seed that of the point.
    """
    design, settings = decode(Design, shared['design']), decode(Settings, shared['settings'])
    kind, tried = values['kind'], values['tried']
    by, right = chance(kind, values['scatter']), np.array(wanted(design, tried))
    count, each = size(shared, kind, tried)
    for one in np.random.SeedSequence(seed).generate_state(count, np.uint64).tolist():
        drawn = generator(one, Stream.LEVELS).choice(len(right), each, replace=False)
        levels = np.sort(drawn)
        counts = np.ones(each)
        if screened(shared, kind, tried):
            specimen = scattered(design, by.scatter, one)
            counts = weights(_forecast(design, settings), specimen, levels, one)
        found = right[levels]
        simulated = counts > 0.0
        if simulated.any():
            try:
                found[simulated] = outcomes(
                    design, settings, by, one, tried, levels[simulated].tolist()
                )
            except DesignError:  # a cell so light that the time step is too long for it: all lost
                found[simulated] = UNDECODABLE
        yield TriedElement(one, levels, counts, found, found != right[levels])


def evaluate(shared: Values, values: Values, seed: int) -> Row:
    """Return the counts of one point; for the arguments see `elements`.

    Returns:
        elements: How many were made.
        simulated: How many trials were simulated.
        squares: Sum over the elements of the square of the number of their failures.
        silent: Reads, of all levels, that were decoded as another level.
        tried_L: Steps from level L, or reads of it.
        failed_L: How many of them failed, weighted if screened.
    """
    levels = range(len(wanted(Design(**shared['design']), values['tried'])))
    tried, failed = np.zeros(len(levels), int), np.zeros(len(levels))
    made = simulated = silent = 0
    squares = 0.0
    for one in elements(shared, values, seed):
        made += 1
        simulated += int(np.count_nonzero(one.counts))
        tried[one.levels] += 1
        failed[one.levels] += one.wrong * one.counts
        squares += float(one.wrong @ one.counts) ** 2
        if values['tried'] != STEP:
            silent += int(np.sum(one.wrong & (one.found != UNDECODABLE)))
    return {
        'elements': made, 'simulated': simulated, 'squares': squares, 'silent': silent,
        **{f'tried_{level}': int(tried[level]) for level in levels},
        **{f'failed_{level}': float(failed[level]) for level in levels},
    }  # fmt: skip


@lru_cache(maxsize=1)
def _forecast(design: Design, settings: Settings) -> StepForecast:
    return StepForecast(design, settings)
