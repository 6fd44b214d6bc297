# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The actuator that strains the substrate: set-points, smooth ramps and timed profiles."""

from __future__ import annotations

from bisect import bisect_left
from itertools import accumulate, repeat

import numpy as np

from ..clipped import clipped
from ..physics.potential import Array
from .commands import FollowTrajectory, is_number
from .errors import Refused
from .motion import Motion, Ramp, shaped
from .settings import ActuatorSettings
from .trajectory import planned


class Actuator:
    """The strain of the element as a function of time.

    Attributes:
        settings: Limits of strain and rate.
        strain: Present strain.
        motion: The present or last move.
        elapsed: Time since that move began, up to the end of the tick in which it ended.
    """

    def __init__(self, settings: ActuatorSettings) -> None:
        self.settings = settings
        self.strain = 0.0
        self.motion: Motion = Ramp(0.0, 0.0, 0.0)
        self.elapsed = 0.0

    @property
    def moving(self) -> bool:
        """Whether the strain still changes."""
        return self.elapsed < self.motion.duration

    @property
    def goal(self) -> float:
        """Strain after the present or last move."""
        limit = self.settings.max_strain
        return max(-limit, min(self.motion.target, limit))

    @property
    def state(self) -> tuple[float, float]:
        """Present strain, and the time since the move began."""
        return self.strain, self.elapsed

    @state.setter
    def state(self, state: tuple[float, float]) -> None:
        self.strain, self.elapsed = state

    @property
    def remaining(self) -> float:
        """Time until the move ends; at most 0 if it has ended."""
        return self.motion.duration - self.elapsed

    def check(self, strain: float) -> None:
        """Raise `Refused` for a strain that is not finite or beyond the limit."""
        limit = self.settings.max_strain
        if not is_number(strain, limit):
            raise Refused(
                f'strain must be a finite number from {-limit:g} to {limit:g} '
                f'(actuator.max_strain); got {clipped(strain)}'
            )

    def hold(self, strain: float) -> None:
        """Stand still at a strain."""
        self.strain = strain
        self._begin(Ramp(strain, strain, 0.0))

    def slew_to(self, strain: float) -> None:
        """Move by hand, with a smooth ramp at the rate limit for that; see `ramp_to`."""
        self.check(strain)  # smooth, since an abrupt start or stop was seen to move the wall
        self._begin(Ramp.limited(self.strain, strain, 0.0, self.settings.by_hand))

    def ramp_to(self, strain: float, duration: float, delay: float = 0.0) -> None:
        """Move to a strain smoothly in a given time, or longer if the rate limit requires it.

        Args:
            strain: The target.
            duration: In time units.
            delay: If not 0, and less than the duration, time between the two half steps in which
                the move is made (see `shaped`).

        Raises:
            Refused: The strain is not finite or beyond the limit.
        """
        self.check(strain)
        two = 0.0 < delay < duration
        ramp = Ramp.limited(self.strain, strain, duration - two * delay, self.settings.max_rate)
        self._begin(shaped(ramp, delay) if two else ramp)

    def follow(self, command: FollowTrajectory, time_unit: float) -> None:
        """Move along a timed profile from the current strain; a time unit is given in seconds.

        Raises:
            Refused: It is not a profile, or exceeds a limit of the actuator.
        """
        self._begin(planned(command, self.strain, self.settings, time_unit))

    def _begin(self, motion: Motion) -> None:
        self.motion = motion
        self.elapsed = 0.0

    def advance(self, times: Array, ticks: int = 1) -> Array:
        """Return the strain during ticks, shape (ticks m,), and advance past them.

        The bits are the same as tick by tick. `times` are those of the m sub-steps since the
        beginning of a tick; the last is its end.
        """
        if self.moving:
            starts = [*accumulate(repeat(float(times[-1]), ticks), initial=self.elapsed)]
            strain = self.motion.strain(np.add.outer(starts[:-1], times).ravel())
            limit = self.settings.max_strain  # a cubic may exceed it by rounding
            np.maximum(np.minimum(strain, limit, out=strain), -limit, out=strain)
            over = bisect_left(starts, self.motion.duration)
            self.elapsed = starts[min(over, ticks)]
        else:
            strain = np.full(ticks * len(times), self.goal)
        self.strain = float(strain[-1])
        return strain
