# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Chains whose elements are not all alike: how a speed scatters, and how a wave may stop.

The second wells scatter (prestrain), as the rest positions of the tracked elements show. A force
on each element may too (a shell that is not straight); how large it would have to be follows from
how unequal the three intervals of a measured wave are, which are the same in repeated runs.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from mlmem_ros.physics.potential import Array

from .fits import Fit, rest
from .runs import CASES, SILENT, Case, runs
from .wave import ELEMENTS, HAND, Losses, Wave, launch, shell

WELL_STEP = 0.005
"""Wells are rounded to this, in cm, so that their shells are made once."""

HANDS = (10.0, 100.0)
"""Shortest and longest time of the hand that is taken for possible, ms."""


@dataclass(frozen=True)
class Scatter:
    """Standard deviations within a chain.

    Attributes:
        well: Of the second wells, relative.
        force: On an element, 10 N.
    """

    well: float
    force: float = 0.0


def well_scatter(cases: Iterable[Case]) -> float:
    """Return the relative standard deviation of rest positions within a chain."""
    relative = [np.var(rest(case), ddof=1) / rest(case).mean() ** 2 for case in cases]
    return float(np.sqrt(np.mean(relative)))


def measured_unevenness(cases: Iterable[Case]) -> float:
    """Return how unequal the intervals between tracked elements are: median relative deviation."""
    return _unevenness([np.mean([run.arrivals for run in runs(case)], axis=0) for case in cases])


def _unevenness(arrivals: Sequence[Array]) -> float:
    intervals = [np.diff(each) for each in arrivals if np.isfinite(each).all()]
    return float(np.median([np.std(d, ddof=1) / d.mean() for d in intervals]))


def launch_chains(
    case: Case,
    fit: Fit,
    scatter: Scatter,
    chains: int,
    generator: np.random.Generator,
    uncertain: bool = False,
) -> list[Wave]:
    """Launch a wave in each of many random chains.

    If uncertain, losses and the hand's time are drawn too, instead of their best values.
    """
    wells = fit.well(case) * (1.0 + scatter.well * generator.standard_normal((chains, ELEMENTS)))
    wells = np.round(wells / WELL_STEP) * WELL_STEP
    bias = scatter.force * generator.standard_normal((chains, ELEMENTS + 1))
    losses, hands = [fit.losses[case.rail]] * chains, np.full(chains, HAND)
    if uncertain:
        best = fit.losses[case.rail]
        drawn = generator.multivariate_normal(
            (best.damping, best.friction), fit.covariance[case.rail], chains
        )
        losses = [Losses(*np.maximum(each, 0.0).tolist()) for each in drawn]
        shortest, longest = HANDS
        hands = shortest * (longest / shortest) ** generator.uniform(size=chains)

    def one(k: int) -> Wave:
        shells = [shell(float(well)) for well in wells[k]]
        return launch(case, shells, losses[k], bias[k], float(hands[k]))

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(one, range(chains)))


def force_scatter(fit: Fit, cases: Sequence[Case], well: float, chains: int, seed: int) -> float:
    """Return the scatter of the force with which chains are as uneven as the measured ones."""
    sizes = np.array([0.0, 0.005, 0.010, 0.015, 0.020])

    def uneven(force: float) -> float:
        generator = np.random.default_rng(seed)  # the same for all: a smooth curve
        scatter = Scatter(well, force)
        return _unevenness(
            [
                wave.arrivals
                for case in cases
                for wave in launch_chains(case, fit, scatter, chains, generator)
            ]
        )

    found = np.array([uneven(size) for size in sizes])
    return float(np.interp(measured_unevenness(cases), np.maximum.accumulate(found), sizes))


def stopped(waves: Sequence[Wave]) -> float:
    """Return the share of waves that do not get past the tracked elements."""
    return float(np.mean([not np.isfinite(wave.speed) for wave in waves]))


def pattern(stops: Mapping[Case, float]) -> float:
    """Return the probability of what was seen: two lattices silent, the other seven not.

    Every lattice is a chain of its own; in each that propagates, all three runs did.
    """
    seen = (stops[case] if case in SILENT else 1.0 - stops[case] for case in CASES)
    return float(np.prod(list(seen)))


def greatest_friction(case: Case, fit: Fit) -> float:
    """Return the dry friction, 10 N, that just lets a wave pass a chain of equal elements."""
    low, high = 0.0, 0.2
    one, damping = shell(fit.well(case)), fit.losses[case.rail].damping
    while high - low > 5e-4:
        middle = 0.5 * (low + high)
        if np.isfinite(launch(case, one, Losses(damping, middle)).speed):
            low = middle
        else:
            high = middle
    return low
