# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whether a step will fail, with the wall as a particle: a hundredth of a simulation's time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property

import numpy as np

from ...analysis.rolling_wall import Schedule, Track, roll, track
from ...device import Settings
from ...device.motion import Cycle
from ...device.settings import peak
from ...physics import Design, Scatter, Specimen, scattered

DT = 4.0
"""Step of the particle in time units; a wall in its defect takes 100 and more for a swing."""

FORESEEN = ('alpha', 's', 'offset')
"""Kinds of scatter for which step failures are forecast."""

RESTING = 0.3
"""Where a wall rests, in cells right of its defect."""


NEAR = 2.0
"""Distance from a defect in cells within which a wall has arrived; its rest position scatters
too."""


class Forecast:
    """The write cycles of an instrument on the walls of a design, reduced to particles."""

    def __init__(self, design: Design, settings: Settings) -> None:
        self._design = design
        self._settings = settings
        self._tracks: dict[int, Track] = {}

    def failing(self, specimen: Specimen, level: int, inflations: Sequence[float]) -> float:
        """Return the first inflation of an element's deviations at which a step up fails.

        Args:
            specimen: The element as it was made.
            level: Where the wall rests.
            inflations: What the deviations from the design are multiplied by, in turn.

        Returns:
            Infinity if none fails.
        """
        design, way = self._design, self._track(level)
        extra = way.extra_pull(specimen)
        start, goal = design.defect(level) + RESTING, design.defect(level + 1)
        cycle = self._cycles[way.peak]
        for inflation in inflations:
            end = roll(way, way.pull + inflation * extra, start, cycle)
            if not abs(end - goal) < NEAR:
                return inflation
        return math.inf

    def _track(self, level: int) -> Track:
        if level not in self._tracks:
            design, write = self._design, self._settings.write
            freed = design.freed_by_compression(level)
            low, high = (
                design.defect(level) - design.J / 2,
                design.defect(level + 1) + design.J / 2,
            )
            self._tracks[level] = track(design, low, high, peak(write, freed))
        return self._tracks[level]

    @cached_property
    def _cycles(self) -> dict[float, Schedule]:
        write = self._settings.write
        return {e: _schedule(self._settings, e) for e in (write.compression, write.tension)}


def _schedule(settings: Settings, strain: float) -> Schedule:
    """Return a write of the next level as the device makes it, independent of ticks."""
    cycle = Cycle.planned(settings.write, strain, settings.actuator.max_rate)
    duration = cycle.duration + settings.write.final_settle
    return Schedule(cycle.strain(np.arange(0.0, duration, DT)), DT)


def forecast_rate(forecast: Forecast, design: Design, scatter: Scatter, steps: int) -> float:
    """Return the fraction of steps that fail by the forecast alone.

    Args:
        forecast: Of the design.
        design: What is to be made.
        scatter: Its deviations.
        steps: About how many steps to try.
    """
    each = design.levels - 1
    failures = [
        forecast.failing(scattered(design, scatter, seed), level, (1.0,)) < math.inf
        for seed in range(max(1, steps // each))
        for level in range(each)
    ]
    return float(np.mean(failures))
