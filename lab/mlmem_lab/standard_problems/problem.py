# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a standard problem is, and what several of them need."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mlmem.physics import Integrator
from mlmem.physics.potential import Array

from ..lattices import Lattice

Answers = dict[str, float]
"""Quantities by name."""


@dataclass(frozen=True)
class Problem:
    """One problem, stated in the docstring of what solves it.

    Attributes:
        step: That of our answer; the problem's own unit of time.
        solve: From an integrator and a step to the answers.
    """

    name: str
    step: float
    solve: Callable[[Integrator, float], Answers]


def define_problem(
    name: str, step: float
) -> Callable[[Callable[[Integrator, float], Answers]], Problem]:
    """Return a decorator that makes a function a problem; arguments as for `Problem`."""
    return lambda solve: Problem(name, step, solve)


def crossing_site(field: Array, level: float) -> float:
    """Return the site, counted from 1, where a field last falls below a level; NaN for none."""
    above = np.flatnonzero(field >= level)
    if not above.size or above[-1] + 1 == len(field):
        return float('nan')
    j = int(above[-1])
    return float(j + 1 + (field[j] - level) / (field[j] - field[j + 1]))


def passage_time(
    lattice: Lattice, level: float, first: int, last: int, every: int, most: int
) -> float:
    """Return the time a falling front takes from one site to another.

    Args:
        lattice: It is advanced until the front has passed.
        level: Displacement that defines the front.
        every: Steps between two looks; times are interpolated.
        most: Looks after which the front is taken to have stopped: NaN.
    """
    times, places = [lattice.time], [crossing_site(lattice.displacement, level)]
    while not places[-1] >= last and len(places) < most:
        lattice.advance(every)
        times.append(lattice.time)
        places.append(crossing_site(lattice.displacement, level))
    if not places[-1] >= last:
        return float('nan')
    rising = np.maximum.accumulate(np.nan_to_num(places))
    return float(np.interp(last, rising, times) - np.interp(first, rising, times))
