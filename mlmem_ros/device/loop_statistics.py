# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How a loop keeps time."""

from __future__ import annotations

import math
from dataclasses import dataclass

LATENESS_MEMORY = 0.002
"""Weight of the newest tick in the running mean and variance of the lateness."""


@dataclass
class LoopStatistics:
    """How the loop keeps time; all times in seconds.

    Attributes:
        ticks: Ticks run.
        overruns: Ticks of wall time that were skipped.
        refused: Commands that were refused.
        lateness_mean: Running mean of how late ticks began.
        lateness_variance: Running variance of the same.
        busy: Running mean of the time a tick takes.
    """

    ticks: int = 0
    overruns: int = 0
    refused: int = 0
    lateness_mean: float = 0.0
    lateness_variance: float = 0.0
    busy: float = 0.0

    def count(self, lateness: float, busy: float, ticks: int = 1) -> None:
        """Count ticks of equal times, in seconds; a time is at least 0 if the clock jumps back."""
        busy = max(0.0, busy)
        self.ticks += ticks
        weight = max(1.0 - (1.0 - LATENESS_MEMORY) ** ticks, ticks / self.ticks)
        deviation = lateness - self.lateness_mean
        self.lateness_mean += weight * deviation
        spread = self.lateness_variance + weight * deviation * deviation
        self.lateness_variance = (1.0 - weight) * spread
        self.busy += weight * (busy - self.busy)

    @property
    def lateness_deviation(self) -> float:
        """Standard deviation of the lateness."""
        return math.sqrt(self.lateness_variance)
