# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Eight gaits of a four-legged soft robot: as many as an element has levels."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Gait:
    """The rhythm of the legs.

    Attributes:
        name: What it is called.
        frequency: Strides per second.
        phases: Phase of each leg as a fraction of a stride: front left, front right, rear left,
            rear right.
        duty: Fraction of the stride in which a leg is inflated.
    """

    name: str
    frequency: float
    phases: tuple[float, float, float, float]
    duty: float

    def compute_pressures(self, time: float) -> tuple[float, ...]:
        """Return the pressure of every leg at a time in seconds, from 0 to 1."""
        if self.frequency == 0.0:
            return (0.0,) * len(self.phases)
        return tuple(
            self._compute_pressure((time * self.frequency + phase) % 1.0) for phase in self.phases
        )

    def _compute_pressure(self, share: float) -> float:
        return math.sin(math.pi * share / self.duty) if share < self.duty else 0.0


GAITS = (
    Gait('rest', 0.0, (0.0, 0.0, 0.0, 0.0), 0.5),
    Gait('crawl', 0.4, (0.0, 0.5, 0.75, 0.25), 0.3),
    Gait('walk', 0.8, (0.0, 0.5, 0.75, 0.25), 0.4),
    Gait('trot', 1.2, (0.0, 0.5, 0.5, 0.0), 0.5),
    Gait('pace', 1.2, (0.0, 0.5, 0.0, 0.5), 0.5),
    Gait('bound', 1.5, (0.0, 0.0, 0.5, 0.5), 0.5),
    Gait('gallop', 2.0, (0.0, 0.1, 0.5, 0.6), 0.4),
    Gait('pronk', 1.0, (0.0, 0.0, 0.0, 0.0), 0.3),
)
"""Gaits by level."""
