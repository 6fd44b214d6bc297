# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A timed strain profile: cubics between points with rates, straight lines without."""

from __future__ import annotations

import itertools
import sys
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..clipped import clipped
from ..physics.potential import Array
from ..words import JOINT
from .commands import FollowTrajectory
from .errors import Refused
from .settings import ActuatorSettings

MOST_POINTS = 10_000
"""Points that a profile may have."""

LONGEST = 1e12
"""Time units that a profile may take."""

ROUNDING = 1e-9
"""Relative excess over a limit that is rounding, not intent."""


@dataclass(frozen=True)
class Profile:
    """A move of the strain through timed points, one segment after the other.

    With rates a segment is the cubic that has the strains and the rates of its two points
    (Hermite), without it is a straight line: as `joint_trajectory_controller` has it.

    Attributes:
        times: Times of the points since the move began in time units: two or more, from 0 on,
            increasing.
        strains: Strains of the points.
        rates: Rates of the points per time unit; empty for straight lines.
    """

    times: tuple[float, ...]
    strains: tuple[float, ...]
    rates: tuple[float, ...] = ()

    @property
    def duration(self) -> float:
        """Time from the first point to the last."""
        return self.times[-1]

    @property
    def target(self) -> float:
        """The last strain, which is kept."""
        return self.strains[-1]

    def strain(self, t: Array) -> Array:
        """Return the strain at the times since the move began; the target afterwards."""
        starts, widths, cubics = self._segments
        segment = np.searchsorted(starts, t, side='right') - 1
        x = (np.minimum(t, self.duration) - starts[segment]) / widths[segment]
        c0, c1, c2, c3 = cubics[:, segment]
        return np.where(t < self.duration, c0 + x * (c1 + x * (c2 + x * c3)), self.target)

    @cached_property
    def _segments(self) -> tuple[Array, Array, Array]:
        """Start and width of every segment, and its cubic in its share of the width, (4, k)."""
        widths, rise = np.diff(self.times), np.diff(self.strains)
        rates = np.array(self.rates)
        early, late = (widths * rates[:-1], widths * rates[1:]) if self.rates else (rise, rise)
        c3 = (early - rise) + (late - rise)
        c2 = (rise - early) - c3
        return np.array(self.times[:-1]), widths, np.stack((self.strains[:-1], early, c2, c3))

    def extremes(self) -> tuple[Array, Array]:
        """Return the greatest magnitudes of strain and rate in every segment, shape (k,) each."""
        with np.errstate(all='ignore'):  # lines have no turning points, steps no finite rate
            _, widths, (c0, c1, c2, c3) = self._segments
            fastest = _within(-c2 / (3.0 * c3))
            root = np.sqrt(c2 * c2 - 3.0 * c1 * c3)
            both = -(c2 + np.copysign(root, c2))  # without cancellation
            turns = (_within(both / (3.0 * c3)), _within(c1 / both))
            ends = (np.zeros_like(c0), np.ones_like(c0))
            strains = [c0 + x * (c1 + x * (c2 + x * c3)) for x in (*ends, *turns)]
            rates = [(c1 + x * (2.0 * c2 + x * 3.0 * c3)) / widths for x in (*ends, fastest)]
        return np.abs(strains).max(axis=0), np.abs(rates).max(axis=0)


def _within(x: Array) -> Array:
    """Return turning points, those outside of their segment or missing moved to its start."""
    return np.where((x > 0.0) & (x < 1.0), x, 0.0)


def planned(
    command: FollowTrajectory, strain: float, settings: ActuatorSettings, time_unit: float
) -> Profile:
    """Return the profile that a command asks for, from the present strain on.

    A first point later than 0 is reached from the present strain, at rest.

    Args:
        command: The points in seconds.
        strain: Present strain.
        settings: Limits of strain and rate.
        time_unit: Seconds per time unit.

    Raises:
        Refused: The points make no profile, or one beyond a limit.
    """
    if command.joint != JOINT:
        raise Refused(f'the joint must be {JOINT!r} alone; got {clipped(command.joint)}')
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
    for name, reached, limit in (
        ('strain', strongest, settings.max_strain),
        ('rate', fastest, settings.max_rate),
    ):
        beyond = np.flatnonzero(~(reached <= limit * (1.0 + ROUNDING)))  # true for NaN, too
        if len(beyond):
            where = int(beyond[0])
            raise Refused(
                f'the {name} must stay within {limit:g} (actuator.max_{name}); it reaches '
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
        if bad := [value for value in column if not _is_finite(value)]:
            raise Refused(f'{name} must be finite numbers; got {clipped(bad[0])}')
    if times[0] < 0.0 or any(late <= early for early, late in itertools.pairwise(times)):
        raise Refused('the times of the points must increase from 0 s on')
    if times[-1] == 0.0:
        raise Refused('the last point must be later than 0 s')
    return columns


def _is_finite(value: object) -> bool:
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    return number and abs(value) <= sys.float_info.max  # type: ignore[arg-type]
