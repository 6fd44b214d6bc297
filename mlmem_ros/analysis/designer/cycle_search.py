# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A faster write by search: CMA-ES over the parts of its time, and both peaks.

The rules of `schedules` hold if ramps are slow compared with the damping. Faster ones depend on
inertia and ringing, and are found by trial: steps in a row on the bare chain, with both peaks off
in many directions at once. CMA-ES is the evolution strategy of Hansen and Ostermeier (2001), by
the package cmaes (the extra `search`).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...device.settings import WriteSettings
from ...physics import Design
from ...physics.potential import Array
from ..steps_up import departures, scaled

RADII = (0.1, 0.2, 0.3, 0.38)
"""Radii of peak errors: the root of the sum of the squares of both relative changes."""

DIRECTIONS = 24
"""Of the changes, on each in turn at one of the radii."""

RINGS = tuple(np.round(np.arange(0.1, 0.46, 0.05), 2))
"""Radii on which the nearest failure is looked for, and how many directions each has."""

ON_A_RING = 12

STEP = 1.0
"""Time step: half as many as a map takes, with the same verdicts on all that ships."""

STEP_SIZE = 0.25
"""Standard deviation of the first trials: a quarter of a share or a peak."""


@dataclass(frozen=True)
class Rows:
    """The steps in a row that a schedule has to make.

    Attributes:
        design: The element.
        starts: Levels that rows begin at; the first step from an odd one is the hardest.
        length: Steps of a row, fewer where the element ends.
    """

    design: Design
    starts: Sequence[int] = (0, 1)
    length: int = 3

    def departures(self, write: WriteSettings, off: tuple[float, float] = (0.0, 0.0)) -> Array:
        """Return how far the wall is from its defect after every step, in cells.

        Args:
            write: The cycles.
            off: Relative changes of compression and tension.
        """
        changed = scaled(write, 1.0 + off[0], 1.0 + off[1])
        last = self.design.levels - 1
        rows = ((start, min(start + self.length, last)) for start in self.starts)
        return np.array(
            [x for row in rows for x in departures(self.design, changed, *row, dt=STEP)]
        )

    def cost(self, write: WriteSettings) -> float:
        """Return the number of failed steps with both peaks off, plus a little for walls far off.

        A wall counts up to a tenth of a step, by its distance over the spacing of levels, so that
        the search has a slope to follow.
        """
        total = 0.0
        for off in ((0.0, 0.0), *ring(DIRECTIONS, itertools.cycle(RADII))):
            away = self.departures(write, off)
            total += float((away >= 1.0).sum() + 0.1 * np.minimum(away / self.design.J, 1.0).sum())
        return total

    def nearest_failure(self, write: WriteSettings) -> float:
        """Return the least radius of `RINGS` on which a step is lost; infinity for none."""
        for radius in RINGS:
            for off in ring(ON_A_RING, itertools.repeat(float(radius))):
                if (self.departures(write, off) >= 1.0).any():
                    return float(radius)
        return math.inf


def search(
    rows: Rows, write: WriteSettings, time: float, *, tick: float, trials: int, seed: int = 0
) -> WriteSettings:
    """Return the best write found for a given time per level.

    Args:
        rows: What it has to make.
        write: Where to begin; everything not searched is taken from it. It rests after its last
            cycle alone.
        time: Time units of a cycle.
        tick: Every ramp is a whole number of ticks.
        trials: Number of schedules to try.
        seed: Of the search.
    """
    from cmaes import CMA

    begin = replace(write, settle=0.0)
    optimizer = CMA(mean=np.zeros(7), sigma=STEP_SIZE, seed=seed)
    best, least = begin, math.inf
    for _ in range(math.ceil(trials / optimizer.population_size)):
        told = []
        for _ in range(optimizer.population_size):
            x = optimizer.ask()
            tried = schedule(begin, x, time, tick)
            cost = rows.cost(tried)
            told.append((x, cost))
            if cost < least:
                best, least = tried, cost
        optimizer.tell(told)
    return best


def schedule(begin: WriteSettings, x: Array, time: float, tick: float) -> WriteSettings:
    """Return the write at a point of the search; at 0 the one it begins with.

    Args:
        begin: Whose shares of the time and peaks are multiplied by exp(x).
        x: Of ramp, hold, ease, release, where the ease ends, and both peaks, shape (7,).
        time: Time units of a cycle.
        tick: The unit of every part.
    """
    parts = np.array([begin.ramp, begin.hold, begin.ease, begin.release]) * np.exp(x[:4])
    ticks = np.maximum(np.round(parts / parts.sum() * time / tick), (1.0, 0.0, 1.0, 1.0))
    ticks[2] = max(1.0, ticks[2] + round(time / tick) - ticks.sum())  # what rounding took
    ramp, hold, ease, release = (ticks * tick).tolist()
    ease_to, compression, tension = np.exp(x[4:]).tolist()
    return replace(
        begin,
        ramp=ramp,
        hold=hold,
        ease=ease,
        ease_to=round(min(1.0, ease_to * begin.ease_to), 3),
        release=release,
        compression=round(compression * begin.compression, 4),
        tension=round(tension * begin.tension, 4),
    )


def ring(directions: int, radii: Iterator[float]) -> Iterator[tuple[float, float]]:
    """Yield relative changes of both peaks in as many directions."""
    for k, radius in zip(range(directions), radii, strict=False):
        angle = 2.0 * math.pi * k / directions
        yield radius * math.cos(angle), radius * math.sin(angle)
