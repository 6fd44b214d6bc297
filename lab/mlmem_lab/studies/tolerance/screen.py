# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which steps of an element to simulate: those that a forecast sees near failure, and few others.

Unequal probability sampling (Horvitz and Thompson 1952): a step simulated with probability q
counts 1 / q times. The estimate is unbiased however bad the forecast is; a good one makes it
cheap. The probability depends on how much the element's deviations from its design can be inflated
before the forecast fails. It should go with the root of the failure rate (Neyman 1934); these
values are near that for the paper's element where two in a thousand fail.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from mlmem_ros.physics import Specimen
from mlmem_ros.physics.potential import Array
from mlmem_ros.rng import Stream, generator

from .particle import StepForecast

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
