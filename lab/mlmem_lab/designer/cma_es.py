# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The search behind `stroke_search`: CMA-ES, and trials with two values off at once.

CMA-ES is the evolution strategy of Hansen and Ostermeier (2001), by the package cmaes (the extra
`search`).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from typing import TypeVar

import numpy as np

from mlmem_ros.physics.potential import Array

Settings = TypeVar('Settings')

DIMENSIONS = 7
"""Coordinates of a point."""

Off = tuple[float, float]
"""Relative changes of two values of a schedule."""


def ring(directions: int, *radii: float) -> list[Off]:
    """Return changes in as many directions, each in turn at one of the radii."""
    angles = (2.0 * math.pi * k / directions for k in range(directions))
    return [(r * math.cos(a), r * math.sin(a)) for a, r in zip(angles, itertools.cycle(radii))]


TRIALS = ((0.0, 0.0), *ring(24, 0.1, 0.2, 0.3, 0.38))
"""The changes under which a schedule is judged."""


def search(
    begin: Settings,
    point: Callable[[Array], Settings],
    cost: Callable[[Settings], float],
    *,
    sigma: float,
    trials: int,
) -> Settings:
    """Return the best settings found; the same ones every time.

    It begins around x = 0, shape (7,), with points of standard deviation sigma.

    Raises:
        ImportError: The package cmaes is missing.
    """
    from cmaes import CMA

    best, least = begin, cost(begin)
    optimizer = CMA(mean=np.zeros(DIMENSIONS), sigma=sigma, seed=0)
    for _ in range(math.ceil(trials / optimizer.population_size)):
        points = [optimizer.ask() for _ in range(optimizer.population_size)]
        tried = [point(x) for x in points]
        costs = [cost(each) for each in tried]
        optimizer.tell(list(zip(points, costs, strict=True)))
        if min(costs) < least:
            least = min(costs)
            best = tried[costs.index(least)]
    return best
