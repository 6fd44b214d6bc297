# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whether a step will fail, with the wall as a particle, in a hundredth of the time of simulation;
and which steps to simulate: those that this forecast sees near failure, and few others.

Unequal probability sampling (Horvitz and Thompson 1952): a step simulated with probability q
counts 1 / q times. The estimate is unbiased however bad the forecast is; a good one makes it
cheap. The probability depends on how much the element's deviations from its design can be inflated
before the forecast fails. It should go with the root of the failure rate (Neyman 1934); these
values are near that for the paper's element where two in a thousand fail.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from mlmem_ros.device import Settings
from mlmem_ros.device.motion import Cycle
from mlmem_ros.device.move_settings import peak
from mlmem_ros.physics import Design, Specimen
from mlmem_ros.physics.potential import Array
from mlmem_ros.rng import Stream, generator

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


PROBABILITY = {1.0: 1.0, 1.5: 0.7, 2.5: 0.4, 4.0: 0.2, math.inf: 0.03}
"""Probability of simulation, by the first inflation at which the forecast fails."""

HEAVIEST = 1.0 / min(PROBABILITY.values())
"""Largest weight of one failure."""

DRAWN = 16
"""Elements drawn with a screen for each one without: about the same computing time."""


def weights(forecast: StepForecast, specimen: Specimen, levels: Iterable[int], seed: int) -> Array:
    """Draw the steps of an element to simulate.

    Returns:
        The weight of each step, in the order of levels: 0 if it is not to be simulated.
    """
    inflations = [inflation for inflation in PROBABILITY if inflation < math.inf]
    q = np.array([PROBABILITY[forecast.failing(specimen, level, inflations)] for level in levels])
    drawn = generator(seed, Stream.SCREEN).random(len(q)) < q
    return np.where(drawn, 1.0 / q, 0.0)
