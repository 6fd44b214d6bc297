# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The actuator that strains the substrate: set-points, smooth ramps and timed profiles."""

from __future__ import annotations

import numpy as np

from ..clipped import clipped
from ..physics.potential import Array
from .commands import FollowTrajectory
from .errors import Refused
from .motion import Motion, Ramp
from .settings import ActuatorSettings
from .trajectory import planned


class Actuator:
    """The strain of the element as a function of time.

    Attributes:
        settings: Limits of strain and rate.
        strain: Present strain.
        motion: The present or last move.
        elapsed: Time since that move began.
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

    def check(self, strain: float) -> None:
        """Raise `Refused` for a strain that is not finite or beyond the limit."""
        limit = self.settings.max_strain
        number = isinstance(strain, (int, float)) and not isinstance(strain, bool)
        if not (number and abs(strain) <= limit):  # false for NaN, too
            raise Refused(
                f'strain must be a finite number from {-limit:g} to {limit:g} '
                f'(actuator.max_strain); got {clipped(strain)}'
            )

    def hold(self, strain: float) -> None:
        """Stand still at a strain."""
        self.strain = strain
        self._begin(Ramp(strain, strain, 0.0))

    def slew_to(self, strain: float) -> None:
        """Move to a strain as fast as the rate limit lets a smooth ramp; see `ramp_to`."""
        self.ramp_to(strain, 0.0)  # an abrupt start or stop was seen to push the wall on

    def ramp_to(self, strain: float, duration: float) -> None:
        """Move to a strain smoothly in a time, or longer if the rate limit asks for it.

        Raises:
            Refused: The strain is not finite or beyond the limit.
        """
        self.check(strain)
        self._begin(Ramp.limited(self.strain, strain, duration, self.settings.max_rate))

    def follow(self, command: FollowTrajectory, time_unit: float) -> None:
        """Move along a timed profile, from where the strain is.

        Args:
            command: The profile.
            time_unit: Seconds per time unit.

        Raises:
            Refused: It is no profile, or beyond a limit of the actuator.
        """
        self._begin(planned(command, self.strain, self.settings, time_unit))

    def _begin(self, motion: Motion) -> None:
        self.motion = motion
        self.elapsed = 0.0

    def rest(self, times: Array, ticks: int) -> None:
        """Let ticks pass while nothing moves: as `advance` does, to the bit of the clock."""
        for _ in range(ticks):
            self.elapsed += float(times[-1])

    def advance(self, times: Array) -> Array:
        """Return the strain at times from now, the last of which becomes now."""
        limit = self.settings.max_strain  # a cubic that just reaches it may round beyond
        if not self.moving:
            self.elapsed += float(times[-1])
            self.strain = max(-limit, min(self.motion.target, limit))
            return np.full_like(times, self.strain)
        strain = np.clip(self.motion.strain(self.elapsed + times), -limit, limit)
        self.elapsed += float(times[-1])
        self.strain = float(strain[-1])
        return strain
