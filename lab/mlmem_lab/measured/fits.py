# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What slows the elements, fitted to some of the cases so that the others are predictions.

- `viscous`: as the authors did, a damping rate per rail that gives the speed at a spacing of 6 cm.
- `front`: damping and dry friction per rail, from speed and shape of the front at 6 cm.
- `steady`: damping and friction common to all rails, from the speeds at 8 cm, where a wave has
  forgotten its start when it reaches the tracked elements. The prestrain of these shells is known
  from where they come to rest; in the other lattices it is the authors' own.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from scipy.optimize import brentq, least_squares

from mlmem_ros.physics.potential import Array

from .runs import CASES, RAILS, Case, Run, runs
from .wave import FIRST, LAST, MEASURED, Losses, Wave, launch, shell

SPEED_ERROR = 0.04
"""Relative error of a mean speed over four elements of a chain that are not all alike."""

SHAPE_ERROR = 0.03
"""Of a front, over its height; its points agree over some 20 of them."""

CORRELATED = 20.0
BEFORE, AFTER, POINTS = 70.0, 60.0, 53
"""The part of a front about an arrival, ms, and where it is compared."""

SCALE = np.array([0.01, 0.01])
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
        return self.wells.get(case, MEASURED[case.rail].well)

    def speed(self, case: Case) -> float:
        """Return the speed in a chain of equal elements, m/s; NaN where nothing propagates."""
        return launch(case, shell(self.well(case)), self.losses[case.rail]).speed


def measured_speed(case: Case) -> float:
    """Return the mean speed of the measured runs of a case, m/s."""
    return float(np.mean([run.speed for run in runs(case)]))


def rest(case: Case) -> Array:
    """Return where the tracked elements of a case come to rest, mean of its runs, cm, (4,)."""
    return np.asarray(np.mean([run.rest for run in runs(case)], axis=0))


def viscous() -> Fit:
    """Return the authors' model: no friction, a damping per rail fitted at 6 cm."""

    def miss(damping: float, case: Case) -> float:
        wave = launch(case, shell(MEASURED[case.rail].well), Losses(damping))
        return wave.speed - measured_speed(case)

    fitted = _at(6.0)
    losses = {case.rail: Losses(float(brentq(miss, 0.01, 0.06, (case,), 1e-5))) for case in fitted}
    return Fit('viscous', losses, fitted)


def front() -> Fit:
    """Return damping and friction per rail, from everything measured at 6 cm."""
    fitted = _at(6.0)
    found = {case.rail: _least_squares(partial(_front_residuals, case)) for case in fitted}
    losses = {rail: each[0] for rail, each in found.items()}
    covariance = {rail: each[1] for rail, each in found.items()}
    return Fit('front', losses, fitted, covariance=covariance)


def steady(left_out: Case | None = None) -> Fit:
    """Return damping and friction for all rails, from the speeds at 8 cm.

    The speed of a case that is left out is not used; its rest positions are.
    """
    at_8 = _at(8.0)
    wells = {case: float(rest(case).mean()) for case in at_8}
    fitted = tuple(case for case in at_8 if case != left_out)

    def residuals(losses: Losses) -> Array:
        ratio = [
            launch(case, shell(wells[case]), losses).speed / measured_speed(case)
            for case in fitted
        ]
        return np.asarray(np.nan_to_num((np.array(ratio) - 1.0) / SPEED_ERROR, nan=10.0))

    losses, covariance = _least_squares(residuals)
    return Fit(
        'steady', dict.fromkeys(RAILS, losses), fitted, wells, dict.fromkeys(RAILS, covariance)
    )


def _at(spacing: float) -> tuple[Case, ...]:
    return tuple(case for case in CASES if case.spacing == spacing)


def _least_squares(residuals: Callable[[Losses], Array]) -> tuple[Losses, Array]:
    """Return the best losses and their covariance."""

    def scaled(x: Array) -> Array:
        damping, friction = np.abs(x) * SCALE  # neither is negative
        return np.asarray(residuals(Losses(damping, friction)))

    found = least_squares(scaled, [1.7, 1.2], diff_step=1e-2, x_scale=0.3)
    covariance = np.linalg.pinv(found.jac.T @ found.jac) * np.outer(SCALE, SCALE)
    return Losses(*(np.abs(found.x) * SCALE).tolist()), covariance


def _front_residuals(case: Case, losses: Losses) -> Array:
    """Return what a simulated wave misses of the measured ones, each about its error."""
    wave = launch(case, shell(MEASURED[case.rail].well), losses, last=LAST + 6)
    if not np.isfinite(wave.speed):
        return np.full(4 * POINTS * len(runs(case)) + 1, 1.0)
    misses = [_shape_misses(run, wave) for run in runs(case)]
    weight = SHAPE_ERROR * np.sqrt(CORRELATED)
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
