# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From a trajectory command to the strain profile that it asks for."""

from __future__ import annotations

import itertools
import sys

import numpy as np

from ..clipped import clipped
from ..levels import JOINT
from .commands import FollowTrajectory, is_number
from .errors import Refused
from .motion import Profile
from .settings import ActuatorSettings

MOST_POINTS = 10_000
"""Most points of a profile."""

LONGEST = 1e12
"""Longest profile, in time units."""

ROUNDING = 1e-9
"""Relative excess over a limit that is rounding, not intent."""


def planned(
    command: FollowTrajectory, strain: float, settings: ActuatorSettings, time_unit: float
) -> Profile:
    """Return the profile that a command asks for, beginning at the present strain; a time unit is
    given in seconds.

    If the first point is later than 0, the profile starts from rest.

    Raises:
        Refused: The points are not a profile, or it exceeds a limit.
    """
    if command.joint != JOINT:
        raise Refused(f'the joint must be {JOINT!r}; got {clipped(command.joint)}')
    times, strains, rates = _checked(command)
    if times[-1] > LONGEST * time_unit:
        raise Refused(
            f'a trajectory must end within {LONGEST * time_unit:g} s; got {times[-1]:g} s'
        )
    if times[0] > 0.0:
        times, strains = (0.0, *times), (strain, *strains)
        rates = (0.0, *rates) if rates else ()
    elif abs(strains[0] - strain) > ROUNDING * settings.max_strain:
        raise Refused(f'a point at 0 s must be the present strain {strain:g}; got {strains[0]:g}')
    profile = Profile(
        tuple(time / time_unit for time in times),
        (strain, *strains[1:]),
        tuple(rate * time_unit for rate in rates),
    )
    strongest, fastest = profile.extremes()
    for name, reached, limit, setting in (
        ('strain', strongest, settings.max_strain, 'max_strain'),
        ('rate', fastest, settings.by_hand, 'hand_rate' if settings.hand_rate else 'max_rate'),
    ):
        beyond = np.flatnonzero(~(reached <= limit * (1.0 + ROUNDING)))  # true for NaN, too
        if len(beyond):
            where = int(beyond[0])
            raise Refused(
                f'the {name} must stay within {limit:g} (actuator.{setting}); it reaches '
                f'{reached[where]:g} between {times[where]:g} s and {times[where + 1]:g} s'
            )
    return profile


def _checked(command: FollowTrajectory) -> tuple[tuple[float, ...], ...]:
    """Return the columns of the points: times, strains and rates."""
    times, strains, rates = columns = command.times, command.strains, command.rates
    if not 1 <= len(times) <= MOST_POINTS:
        raise Refused(f'a trajectory must have 1 to {MOST_POINTS} points; got {len(times)}')
    if len(strains) != len(times):
        raise Refused(f'every point must have one strain; got {len(strains)} for {len(times)}')
    if len(rates) not in (0, len(times)):
        raise Refused(
            f'either every point or none must have a rate; got {len(rates)} for {len(times)}'
        )
    for name, column in zip(('times', 'strains', 'rates'), columns, strict=True):
        if bad := [value for value in column if not is_number(value, sys.float_info.max)]:
            raise Refused(f'{name} must be finite numbers; got {clipped(bad[0])}')
    if times[0] < 0.0 or any(late <= early for early, late in itertools.pairwise(times)):
        raise Refused('the times of the points must increase from 0 s')
    if times[-1] == 0.0:
        raise Refused('the last point must be later than 0 s')
    return columns
