# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whether a step will fail, with the wall as a particle: a hundredth of the time of simulation."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from mlmem_ros.device import Settings
from mlmem_ros.device.motion import Cycle
from mlmem_ros.device.settings import peak
from mlmem_ros.physics import Design, Specimen

from ...landscapes.rolling_wall import Schedule, Track, roll, track

DT = 4.0
"""Step of the particle in time units; a wall in its defect takes 100 and more for a swing."""

FORESEEN = ('alpha', 'k_r', 's', 'offset')
"""Kinds of scatter for which step failures are forecast."""

RESTING = 0.3
"""Where a wall rests, in cells right of its defect."""

NEAR = 2.0
"""Distance from a defect in cells within which a wall has arrived; its rest position scatters
too."""


class StepForecast:
    """The write cycles of an instrument on the walls of a design, reduced to particles."""

    def __init__(self, design: Design, settings: Settings) -> None:
        self._design = design
        self._settings = settings
        self._ways: dict[int, tuple[Track, Schedule]] = {}

    def failing(self, specimen: Specimen, level: int, inflations: Sequence[float]) -> float:
        """Return the first inflation of an element's deviations at which a step up fails.

        They are factors on the deviations from the design.

        Returns:
            Infinity if none fails.
        """
        if level not in self._ways:
            self._ways[level] = self._way(level)
        way, cycle = self._ways[level]
        extra = way.extra_pull(specimen)
        start, goal = self._design.defect(level) + RESTING, self._design.defect(level + 1)
        for inflation in inflations:
            end = roll(way, way.pull + inflation * extra, start, cycle)
            if not abs(end - goal) < NEAR:
                return inflation
        return math.inf

    def _way(self, level: int) -> tuple[Track, Schedule]:
        """Return the track of a step up, and the strain of its write, independent of ticks."""
        design, write = self._design, self._settings.write
        strain = peak(write, design.freed_by_compression(level))
        low, high = design.defect(level) - design.J / 2, design.defect(level + 1) + design.J / 2
        cycle = Cycle.planned(write, strain, self._settings.actuator.max_rate)
        times = np.arange(0.0, cycle.duration + write.final_settle, DT)
        return track(design, low, high, strain), Schedule(cycle.strain(times), DT)
