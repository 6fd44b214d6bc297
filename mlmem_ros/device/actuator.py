# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The actuator that strains the substrate: set-points, smooth ramps and timed profiles."""

from __future__ import annotations

import numpy as np

from ..clipped import clipped
from ..physics.potential import Array
from .commands import FollowTrajectory
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

    @property
    def state(self) -> tuple[float, float]:
        """Present strain, and the time since the move began."""
        return self.strain, self.elapsed

    @state.setter
    def state(self, state: tuple[float, float]) -> None:
        self.strain, self.elapsed = state

    @property
    def left(self) -> float:
        """Time until it stands still; at most 0 if it does."""
        return self.motion.duration - self.elapsed

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
        """Move by hand: as fast as its own rate limit lets a smooth ramp; see `ramp_to`."""
        self.check(strain)  # an abrupt start or stop was seen to move the wall
        self._begin(Ramp.limited(self.strain, strain, 0.0, self.settings.by_hand))

    def ramp_to(self, strain: float, duration: float, delay: float = 0.0) -> None:
        """Move to a strain smoothly in a given time, or longer if the rate limit requires it.

        Args:
            strain: Where to.
            duration: In time units.
            delay: If not 0, the move is made in two half steps this far apart (see `shaped`), if
                it takes long enough.

        Raises:
            Refused: The strain is not finite or beyond the limit.
        """
        self.check(strain)
        two = 0.0 < delay < duration
        ramp = Ramp.limited(self.strain, strain, duration - two * delay, self.settings.max_rate)
        self._begin(shaped(ramp, delay) if two else ramp)

    def follow(self, command: FollowTrajectory, time_unit: float) -> None:
        """Move along a timed profile, from the current strain.

        Args:
            command: The profile.
            time_unit: Seconds per time unit.

        Raises:
            Refused: It is not a profile, or exceeds a limit of the actuator.
        """
        self._begin(planned(command, self.strain, self.settings, time_unit))

    def _begin(self, motion: Motion) -> None:
        self.motion = motion
        self.elapsed = 0.0

    def advance(self, times: Array, ticks: int = 1) -> Array:
        """Return the strain during ticks, and advance past them.

        Args:
            times: In a tick from its beginning, the last being its end, shape (m,).
            ticks: How many.

        Returns:
            Shape (ticks m,): that of every tick alone, to the bit.
        """
        limit = self.settings.max_strain  # a cubic that just reaches it may round beyond
        starts = np.cumsum([self.elapsed, *[times[-1]] * ticks])  # one by one, as the clock goes
        if self.moving:
            t = (starts[:-1, None] + times).ravel()
            strain = np.clip(self.motion.strain(t), -limit, limit)
        else:
            strain = np.full(ticks * len(times), max(-limit, min(self.motion.target, limit)))
        self.elapsed = float(starts[-1])
        self.strain = float(strain[-1])
        return strain
