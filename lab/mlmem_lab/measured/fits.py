# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What slows the elements, fitted to some of the cases so that the others are predictions.

- `fit_viscous`: as the authors did, a damping rate per rail that gives the speed at a spacing of
6 cm.
- `fit_front`: damping and dry friction per rail, from speed and shape of the front at 6 cm.
- `fit_steady`: damping and friction common to all rails, from the speeds at 8 cm, where a wave has
  forgotten its start when it reaches the tracked elements. The prestrain of these shells is known
  from where they come to rest; in the other lattices it is the authors' own.

In a chain whose elements are not all alike a speed scatters, and a wave may stop. The second wells
scatter (prestrain), as the rest positions of the tracked elements show. A force on each element
may too (a shell that is not straight); how large it would have to be follows from how unequal the
three intervals of a measured wave are, which are the same in repeated runs.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from scipy.optimize import brentq, least_squares

from mlmem.physics.potential import Array

from .runs import ALL_CASES, RAIL_DISTANCES_CM, SILENT_CASES, Case, Run, load_runs
from .wave import (
    ELEMENT_COUNT,
    FIRST,
    HAND_TIME_MS,
    LAST,
    MEASURED_SHELLS,
    Losses,
    Wave,
    build_shell,
    launch_wave,
)

SPEED_ERROR = 0.04
"""Relative error of a mean speed over four elements of a chain that are not all alike."""

SHAPE_ERROR = 0.03
"""Of a front, over its height; its points agree over some 20 of them."""

ROWS_PER_DATUM = 20.0
BEFORE, AFTER, POINTS = 70.0, 60.0, 53
"""The part of a front about an arrival, ms, and where it is compared."""

LOSS_SCALE = np.array([0.01, 0.01])
"""Of damping and friction, so that both are about 1 for the fit."""


@dataclass(frozen=True, eq=False)
class Fit:
    """Losses, and what they were fitted to.

    Attributes:
        name: See the module.
        losses: By rail.
        fitted: The cases whose data were used.
        wells: Second wells that were set from rest positions, by case, cm.
        covariance: Of damping (1/ms) and friction (10 N), by rail, shape (2, 2).
    """

    name: str
    losses: Mapping[float, Losses]
    fitted: tuple[Case, ...]
    wells: Mapping[Case, float] = field(default_factory=dict)
    covariance: Mapping[float, Array] = field(default_factory=dict)

    def well(self, case: Case) -> float:
        """Return the second well of a case's shells, cm."""
        return self.wells.get(case, MEASURED_SHELLS[case.rail].well)

    def speed(self, case: Case) -> float:
        """Return the speed in a chain of equal elements, m/s; NaN where nothing propagates."""
        return launch_wave(case, build_shell(self.well(case)), self.losses[case.rail]).speed


def measured_speed(case: Case) -> float:
    """Return the mean speed of the measured runs of a case, m/s."""
    return float(np.mean([run.speed for run in load_runs(case)]))


def measured_rest(case: Case) -> Array:
    """Return where the tracked elements of a case come to rest, mean of its runs, cm, (4,)."""
    return np.asarray(np.mean([run.rest for run in load_runs(case)], axis=0))


def fit_viscous() -> Fit:
    """Return the authors' model: no friction, a damping per rail fitted at 6 cm."""

    def speed_error(damping: float, case: Case) -> float:
        wave = launch_wave(case, build_shell(MEASURED_SHELLS[case.rail].well), Losses(damping))
        return wave.speed - measured_speed(case)

    fitted = _cases_with_spacing(6.0)
    losses = {
        case.rail: Losses(float(brentq(speed_error, 0.01, 0.06, (case,), 1e-5))) for case in fitted
    }
    return Fit('viscous', losses, fitted)


def fit_front() -> Fit:
    """Return damping and friction per rail, from everything measured at 6 cm."""
    fitted = _cases_with_spacing(6.0)
    found = {case.rail: _least_squares(partial(_front_residuals, case)) for case in fitted}
    losses = {rail: each[0] for rail, each in found.items()}
    covariance = {rail: each[1] for rail, each in found.items()}
    return Fit('front', losses, fitted, covariance=covariance)


def fit_steady(left_out: Case | None = None) -> Fit:
    """Return damping and friction for all rails, from the speeds at 8 cm.

    The speed of a case that is left out is not used; its rest positions are.
    """
    at_8 = _cases_with_spacing(8.0)
    wells = {case: float(measured_rest(case).mean()) for case in at_8}
    fitted = tuple(case for case in at_8 if case != left_out)

    def speed_residuals(losses: Losses) -> Array:
        ratio = [
            launch_wave(case, build_shell(wells[case]), losses).speed / measured_speed(case)
            for case in fitted
        ]
        return np.asarray(np.nan_to_num((np.array(ratio) - 1.0) / SPEED_ERROR, nan=10.0))

    losses, covariance = _least_squares(speed_residuals)
    return Fit(
        'steady',
        dict.fromkeys(RAIL_DISTANCES_CM, losses),
        fitted,
        wells,
        dict.fromkeys(RAIL_DISTANCES_CM, covariance),
    )


def _cases_with_spacing(spacing: float) -> tuple[Case, ...]:
    return tuple(case for case in ALL_CASES if case.spacing == spacing)


def _least_squares(residuals: Callable[[Losses], Array]) -> tuple[Losses, Array]:
    """Return the best losses and their covariance."""

    def scaled_residuals(x: Array) -> Array:
        damping, friction = np.abs(x) * LOSS_SCALE  # neither is negative
        return np.asarray(residuals(Losses(damping, friction)))

    found = least_squares(scaled_residuals, [1.7, 1.2], diff_step=1e-2, x_scale=0.3)
    covariance = np.linalg.pinv(found.jac.T @ found.jac) * np.outer(LOSS_SCALE, LOSS_SCALE)
    return Losses(*(np.abs(found.x) * LOSS_SCALE).tolist()), covariance


def _front_residuals(case: Case, losses: Losses) -> Array:
    """Return what a simulated wave misses of the measured ones, each about its error."""
    wave = launch_wave(case, build_shell(MEASURED_SHELLS[case.rail].well), losses, last=LAST + 6)
    if not np.isfinite(wave.speed):
        return np.full(4 * POINTS * len(load_runs(case)) + 1, 1.0)
    misses = [_shape_misses(run, wave) for run in load_runs(case)]
    weight = SHAPE_ERROR * np.sqrt(ROWS_PER_DATUM)
    off = (wave.speed / measured_speed(case) - 1.0) / SPEED_ERROR
    return np.append(np.concatenate(misses) / weight, off)


def _shape_misses(run: Run, wave: Wave) -> Array:
    """Return measured minus simulated fronts, each about its own arrival, over its height."""
    about = np.linspace(-BEFORE, AFTER, POINTS)
    tracked = range(FIRST, LAST + 1)
    misses = []
    for u, own, height, j, other in zip(
        run.u, run.arrivals, run.rest, tracked, wave.arrivals, strict=True
    ):
        measured = np.interp(about + own, run.t, u / height)
        misses.append(measured - np.interp(about + other, wave.t, wave.u[:, j] / wave.wells[j]))
    return np.concatenate(misses)


WELL_STEP = 0.005
"""Wells are rounded to this, in cm, so that their shells are made once."""

HAND_TIME_BOUNDS_MS = (10.0, 100.0)
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
    relative = [
        np.var(measured_rest(case), ddof=1) / measured_rest(case).mean() ** 2 for case in cases
    ]
    return float(np.sqrt(np.mean(relative)))


def measured_unevenness(cases: Iterable[Case]) -> float:
    """Return how unequal the intervals between tracked elements are: median relative deviation."""
    return _arrival_unevenness(
        [np.mean([run.arrivals for run in load_runs(case)], axis=0) for case in cases]
    )


def _arrival_unevenness(arrivals: Sequence[Array]) -> float:
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
    wells = fit.well(case) * (
        1.0 + scatter.well * generator.standard_normal((chains, ELEMENT_COUNT))
    )
    wells = np.round(wells / WELL_STEP) * WELL_STEP
    bias = scatter.force * generator.standard_normal((chains, ELEMENT_COUNT + 1))
    losses, hands = [fit.losses[case.rail]] * chains, np.full(chains, HAND_TIME_MS)
    if uncertain:
        best = fit.losses[case.rail]
        drawn = generator.multivariate_normal(
            (best.damping, best.friction), fit.covariance[case.rail], chains
        )
        losses = [Losses(*np.maximum(each, 0.0).tolist()) for each in drawn]
        shortest, longest = HAND_TIME_BOUNDS_MS
        hands = shortest * (longest / shortest) ** generator.uniform(size=chains)

    def launch_chain(k: int) -> Wave:
        shells = [build_shell(float(well)) for well in wells[k]]
        return launch_wave(case, shells, losses[k], bias[k], float(hands[k]))

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(launch_chain, range(chains)))


def force_scatter(fit: Fit, cases: Sequence[Case], well: float, chains: int, seed: int) -> float:
    """Return the scatter of the force with which chains are as uneven as the measured ones."""
    sizes = np.array([0.0, 0.005, 0.010, 0.015, 0.020])

    def force_unevenness(force: float) -> float:
        generator = np.random.default_rng(seed)  # the same for all: a smooth curve
        scatter = Scatter(well, force)
        return _arrival_unevenness(
            [
                wave.arrivals
                for case in cases
                for wave in launch_chains(case, fit, scatter, chains, generator)
            ]
        )

    found = np.array([force_unevenness(size) for size in sizes])
    return float(np.interp(measured_unevenness(cases), np.maximum.accumulate(found), sizes))


def share_stopped(waves: Sequence[Wave]) -> float:
    """Return the share of waves that do not get past the tracked elements."""
    return float(np.mean([not np.isfinite(wave.speed) for wave in waves]))


def pattern_probability(stops: Mapping[Case, float]) -> float:
    """Return the probability of what was seen: two lattices silent, the other seven not.

    Every lattice is a chain of its own; in each that propagates, all three runs did.
    """
    seen = (stops[case] if case in SILENT_CASES else 1.0 - stops[case] for case in ALL_CASES)
    return float(np.prod(list(seen)))


def greatest_friction(case: Case, fit: Fit) -> float:
    """Return the dry friction, 10 N, that just lets a wave pass a chain of equal elements."""
    low, high = 0.0, 0.2
    one, damping = build_shell(fit.well(case)), fit.losses[case.rail].damping
    while high - low > 5e-4:
        middle = 0.5 * (low + high)
        if np.isfinite(launch_wave(case, one, Losses(damping, middle)).speed):
            low = middle
        else:
            high = middle
    return low
