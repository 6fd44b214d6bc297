# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The base that carries the element: a shaking robot."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from ..errors import Refused
from ..physics.values import Array
from ..schema import is_number
from ..settings import DisturbanceSettings

Shakes = Mapping[int, float]
"""Accelerations that take effect within a run, by number of the tick, from 0."""

NO_SHAKES: Shakes = MappingProxyType({})


@dataclass(frozen=True)
class BaseState:
    """The state of the base.

    Attributes:
        acceleration: Its acceleration now, in lattice constants per time unit squared.
        target: That at the end of the next tick.
        silence: Whole ticks since the last message.
    """

    acceleration: float = 0.0
    target: float = 0.0
    silence: int = 0


class Base:
    """Turns occasional acceleration messages into a continuous acceleration.

    The acceleration ramps linearly to a message's value by the end of the following tick, and
    holds until the next message. Once no message has come for the time-out, the base comes to rest
    within one tick: a dead sensor shakes nothing.
    """

    def __init__(self, settings: DisturbanceSettings, tick: float, most: float = math.inf) -> None:
        """Start at rest; a tick is in time units, and beyond the acceleration `most` no cell stays
        in place.
        """
        self.state = BaseState()
        self._settings = settings
        self._limit = min(settings.max_acceleration, most)
        self._timeout_ticks = math.ceil(settings.timeout / tick)

    def check(self, acceleration: float) -> None:
        """Raise `Refused` for an acceleration that is not finite or beyond the limit."""
        limit = self._limit
        whose = 'disturbance.max_acceleration'
        if limit < self._settings.max_acceleration:
            whose = 'beyond it no cell of this design stays in place'
        if not is_number(acceleration, limit):
            raise Refused.out_of_range(
                'acceleration',
                acceleration,
                f'a finite number from {-limit:g} to {limit:g} lattice constants per time unit '
                f'squared ({whose})',
            )

    @property
    def is_still(self) -> bool:
        """Whether it is at rest, and stays so without a message."""
        return self.state.acceleration == self.state.target == 0.0

    def find_harmful_tick(self, shakes: Shakes = NO_SHAKES) -> int | None:
        """Return in which tick of a run with these accelerations it first shakes enough to move a
        wall; None if it does not.
        """
        limit = self._settings.safe_limit
        if max(abs(self.state.acceleration), abs(self.state.target)) > limit:
            return 0
        return min((tick for tick, shake in shakes.items() if abs(shake) > limit), default=None)

    def accept_acceleration(self, acceleration: float) -> None:
        """Take an acceleration message.

        Raises:
            Refused: The acceleration is not finite or beyond the limit.
        """
        self.check(acceleration)
        self.state = BaseState(self.state.acceleration, float(acceleration))

    def advance(self, progress: Array, ticks: int = 1, shakes: Shakes = NO_SHAKES) -> Array | None:
        """Return the acceleration during ticks, shape (ticks m,), or None for a base at rest.

        Args:
            progress: End of each of the m sub-steps as a fraction of the tick.
            shakes: Accelerations as in `disturb`, each from its tick on.
        """
        if self.is_still and not shakes:
            return None
        courses = []
        for tick in range(ticks):
            if tick in shakes:
                self.accept_acceleration(shakes[tick])
            courses.append(self._advance_tick(progress))
        return np.concatenate(courses)

    def _advance_tick(self, progress: Array) -> Array:
        begin, target, silence = self.state.acceleration, self.state.target, self.state.silence
        if silence >= self._timeout_ticks:
            target = 0.0
        self.state = BaseState(target, target, silence + 1 if target else 0)
        return np.asarray(begin + (target - begin) * progress)
