# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A strain cycle, told beforehand as the actuator makes it: its strain, and its duration."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..device.actuator import Motion
from ..device.settings import CycleSettings
from ..physics.potential import Array


@dataclass(frozen=True)
class StrainCycle:
    """Moves and waits, one after the other, from no strain back to none.

    Attributes:
        motions: In their order; a wait is a move to where the strain is.
    """

    motions: tuple[Motion, ...]

    @classmethod
    def planned(cls, times: CycleSettings, peak: float, max_rate: float = math.inf) -> StrainCycle:
        """Return the cycle that `procedures.blocks.cycle` makes, whatever the ticks.

        Args:
            times: Ramp, hold, ease, release and settle.
            peak: Greatest strain, negative for compression.
            max_rate: Of the actuator, in strain per time unit; ramps it cannot follow take longer.
        """
        legs = [(peak, times.ramp), (peak, times.hold)]
        if times.ease:
            legs.append((times.ease_to * peak, times.ease))
        legs += [(0.0, times.release), (0.0, times.settle)]
        starts = [0.0, *(target for target, _ in legs)]
        return cls(
            tuple(
                Motion.limited(start, target, duration, max_rate)
                for start, (target, duration) in zip(starts, legs, strict=False)
            )
        )

    @cached_property
    def duration(self) -> float:
        """Time units from beginning to end."""
        return sum(motion.duration for motion in self.motions)

    @property
    def segments(self) -> list[tuple[float, float]]:
        """Target and duration of each motion that takes time."""
        return [(each.target, each.duration) for each in self.motions if each.duration > 0.0]

    def strain(self, t: Array) -> Array:
        """Return the strain at rising times since the cycle began, shape (m,)."""
        ends = np.cumsum([motion.duration for motion in self.motions])
        parts = np.split(t, np.searchsorted(t, ends[:-1], side='right'))
        begins = np.concatenate(([0.0], ends[:-1]))
        return np.concatenate(
            [
                motion.strain(part - begin)
                for motion, part, begin in zip(self.motions, parts, begins, strict=True)
            ]
        )
