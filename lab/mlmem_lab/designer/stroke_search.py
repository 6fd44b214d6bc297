# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Strokes and throws by search over their times, peaks, and how these fall with the site.

The closed forms of `throws` neglect pins and waves, so their proposal is only a starting point. A
map of peaks alone does not show the margins: every trial is judged with peak and times off in many
directions, each in a random element. CMA-ES is the evolution strategy of Hansen and Ostermeier
(2001), by the package cmaes (the extra `search`).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np

from mlmem_ros.device.motion import Cycle
from mlmem_ros.device.moves import stroke_peak
from mlmem_ros.device.settings import StrokeSettings, ThrowSettings
from mlmem_ros.device.strokes import actuator
from mlmem_ros.physics import Design, Scatter, scattered, walls
from mlmem_ros.physics.potential import Array
from mlmem_tools.checks.bare import COARSE, configuration_after

Move = TypeVar('Move', bound=StrokeSettings | ThrowSettings)

CLUMSY = 0.5
"""Cost of a throw that leaves the wall at a lower level, relative to one that loses it."""

PRICE = 0.01
"""Cost of every damping time of a cycle: of two equally good ones, prefer the quicker."""

STEP_SIZE = 0.2
"""Standard deviation of the first trials, in logarithms of times and peaks."""

SCATTER = 1e-3
"""Standard deviation of alpha in the trial elements."""

LARGEST = actuator(1).max_strain
"""Greatest peak to try."""

DIMENSIONS = 7
"""Coordinates of a point."""

Off = tuple[float, float]
"""Relative changes of the peak and of the times."""


def ring(directions: int, *radii: float) -> list[Off]:
    """Return changes in as many directions, each in turn at one of the radii."""
    angles = (2.0 * math.pi * k / directions for k in range(directions))
    return [(r * math.cos(a), r * math.sin(a)) for a, r in zip(angles, itertools.cycle(radii))]


TRIALS = ((0.0, 0.0), *ring(24, 0.1, 0.2, 0.3, 0.38))
"""The changes under which a move is judged."""


@dataclass(frozen=True)
class MoveTask:
    """The task of a stroke or a throw.

    Attributes:
        design: The element.
        starts: Levels from which it must work.
    """

    design: Design
    starts: Sequence[int]

    def cost(self, move: StrokeSettings | ThrowSettings) -> float:
        """Return the fraction that fails with peak and times off, plus a little for its time."""
        share = [self.lost(move, off, seed) for seed, off in enumerate(TRIALS)]
        return float(np.mean(share)) + PRICE * duration(move) * self.design.eta

    def lost(self, move: StrokeSettings | ThrowSettings, off: Off, seed: int) -> float:
        """Return the fraction of starts that fails.

        Peak and times are off by relative changes; the seed is that of the trial element.
        """
        changed = stretched(move, 1.0 + off[0], 1.0 + off[1])
        specimen = scattered(self.design, Scatter(alpha=SCATTER), seed)
        total = 0.0
        for start in self.starts:
            if isinstance(changed, ThrowSettings):
                peak, target = changed.peak, None
            else:
                peak = stroke_peak(self.design, changed, start)
                target = start - changed.levels
            after = configuration_after(specimen, Cycle.planned(changed, peak), start, dt=COARSE)
            total += 1.0 if after is None else self._wrong(after, target)
        return total / len(self.starts)

    def _wrong(self, after: Array, target: int | None) -> float:
        """Return 0 for a wall at the target, or a blank element for None; 1 if it is lost."""
        low, high = self.design.wells
        found = walls(self.design, after)
        if not (after.min() > low and after.max() < high and len(found) <= 1):
            return 1.0
        if target is None:
            return CLUMSY * len(found) if after[-1] < self.design.D_barrier else 1.0
        if not found or not found[0].anti_kink:
            return 1.0
        away = abs(found[0].position - self.design.defect(target))
        return 0.0 if away < 1.0 else 0.5 + 0.5 * min(1.0, away / (2.0 * self.design.J))


def stretched(move: Move, peak: float, time: float) -> Move:
    """Return a stroke or a throw with factors on its peak and on all its times."""
    times = ('ramp', 'hold', 'ease', 'release', 'settle')
    changed = {name: getattr(move, name) * time for name in times}
    return replace(move, peak=move.peak * peak, **changed)


def duration(move: StrokeSettings | ThrowSettings) -> float:
    """Return the time that it takes."""
    return Cycle.planned(move, move.peak).duration


def search(task: MoveTask, begin: Move, *, trials: int, tick: float = 20.0) -> Move:
    """Return the best stroke or throw found, the same one every time.

    Sign, levels and rest of the beginning are kept; every part except `ease` is a whole number of
    ticks.

    Raises:
        ImportError: The package cmaes is missing.
    """
    from cmaes import CMA

    best, least = begin, task.cost(begin)
    optimizer = CMA(mean=np.zeros(DIMENSIONS), sigma=STEP_SIZE, seed=0)
    for _ in range(math.ceil(trials / optimizer.population_size)):
        points = [optimizer.ask() for _ in range(optimizer.population_size)]
        tried = [point(begin, x, tick) for x in points]
        costs = [task.cost(each) for each in tried]
        optimizer.tell(list(zip(points, costs, strict=True)))
        if min(costs) < least:
            least = min(costs)
            best = tried[costs.index(least)]
    return best


def point(begin: Move, x: Array, tick: float) -> Move:
    """Return the stroke or throw at a point of the search; at 0 the beginning.

    Args:
        begin: Whose times and peak are multiplied by exp(x).
        x: Of ramp, hold, ease, release and peak; then what is added to ease_to and, of a stroke,
            to growth; shape (7,).
        tick: The unit of ramp, hold and release.
    """
    ramp, hold, ease, release, peak = np.exp(x[:5]).tolist()
    growth: dict[str, Any] = {}
    if isinstance(begin, StrokeSettings):
        growth['growth'] = round(float(np.clip(begin.growth + x[6], 0.0, 3.0)), 3)
    return replace(
        begin,
        ramp=max(1, round(begin.ramp * ramp / tick)) * tick,
        hold=round(begin.hold * hold / tick) * tick,
        ease=float(max(1, round(begin.ease * ease))),
        ease_to=round(float(np.clip(begin.ease_to + 0.5 * x[5], -1.0, 1.0)), 3),
        release=max(1, round(begin.release * release / tick)) * tick,
        peak=round(float(np.clip(begin.peak * peak, -LARGEST, LARGEST)), 4),
        **growth,
    )
