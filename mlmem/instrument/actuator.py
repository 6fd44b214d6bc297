# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From a command to the strain of the substrate: the actuator, and what is between both.

The `Actuator` makes set-points, smooth ramps and timed profiles into a commanded strain. The
`Transmission` brings it to the substrate: motor (may be stuck or lag; read by the encoder) ->
grip (may slip or be mounted askew) -> substrate. Each follows the one before it and makes up a
difference no faster than a strain that is set by hand. So a fault that comes or goes does not jerk
cells out of their phase.
"""

from __future__ import annotations

import itertools
import sys
from bisect import bisect_left
from dataclasses import MISSING, dataclass
from itertools import accumulate, repeat
from typing import TYPE_CHECKING

import numpy as np

from ..errors import ErrorCode, Refused
from ..physics.formulas import exponential
from ..physics.values import Array
from ..procedure_table import JOINT_NAME
from ..rng import RandomStream, draw_event
from ..schema import describe_field, is_number
from ..settings import ActuatorSettings
from .faults import Faults
from .motion import Motion, Profile, Ramp, shape_ramp

if TYPE_CHECKING:
    from ..commands import FollowTrajectory


@dataclass(frozen=True)
class ActuatorState:
    """The state of an actuator.

    Attributes:
        motion: The present or last move.
        strain: The present strain.
        elapsed: Time since that move began, up to the end of the tick in which it ended.
    """

    motion: Motion
    strain: float
    elapsed: float = describe_field(MISSING, 'time since the move began', low=0.0)


class Actuator:
    """The strain of the element as a function of time; for its attributes see `ActuatorState`."""

    def __init__(self, settings: ActuatorSettings) -> None:
        self.settings = settings
        self.state = ActuatorState(Ramp(0.0, 0.0, 0.0), 0.0, 0.0)

    @property
    def is_moving(self) -> bool:
        """Whether the strain still changes."""
        return self.elapsed < self.motion.duration

    @property
    def target_strain(self) -> float:
        """Strain after the present or last move."""
        limit = self.settings.max_strain
        return max(-limit, min(self.motion.target, limit))

    @property
    def state(self) -> ActuatorState:
        """Its motion, and how far that is."""
        return ActuatorState(self.motion, self.strain, self.elapsed)

    @state.setter
    def state(self, state: ActuatorState) -> None:
        self.motion, self.strain, self.elapsed = state.motion, state.strain, state.elapsed

    @property
    def remaining_time(self) -> float:
        """Time until the move ends; at most 0 if it has ended."""
        return self.motion.duration - self.elapsed

    def check(self, strain: float) -> None:
        """Raise `Refused` for a strain that is not finite or beyond the limit."""
        limit = self.settings.max_strain
        if not is_number(strain, limit):
            raise Refused.out_of_range(
                'strain',
                strain,
                f'a finite number from {-limit:g} to {limit:g} (actuator.max_strain)',
            )

    def check_state(self, state: ActuatorState) -> None:
        """Raise `ValueError` for a state whose motion is none, or is beyond the limit."""
        motion = state.motion
        if isinstance(motion, Profile):
            motion.check()
        if motion.duration < 0.0:
            raise ValueError(f'a move must take a finite time; got {motion.duration}')
        ends = motion.strains if isinstance(motion, Profile) else (motion.start, motion.target)
        for strain in (*ends, state.strain):
            self.check(strain)

    def hold(self, strain: float) -> None:
        """Stand still at a strain."""
        self.strain = strain
        self._begin_motion(Ramp(strain, strain, 0.0))

    def slew_to(self, strain: float) -> bool:
        """Move by hand, with a smooth ramp at the rate limit for that; see `ramp_to`.

        Returns:
            False if it stands there, or moves there by hand already: that goes on. A ramp that
            began anew with every repetition of its set-point would crawl.
        """
        self.check(strain)  # smooth, since an abrupt start or stop was seen to move the wall
        motion, by_hand = self.motion, self.settings.hand_rate_limit
        if self.is_moving:
            begun = motion.start if isinstance(motion, Ramp) else self.strain
            goes_on = motion == Ramp.build_rate_limited(begun, strain, 0.0, by_hand)
        else:
            goes_on = strain == self.strain
        if not goes_on:
            self._begin_motion(Ramp.build_rate_limited(self.strain, strain, 0.0, by_hand))
        return not goes_on

    def ramp_to(self, strain: float, duration: float, delay: float = 0.0) -> None:
        """Move to a strain smoothly in a given time, or longer if the rate limit requires it.

        Args:
            strain: The target.
            duration: In time units.
            delay: If not 0, and less than the duration, time between the two half steps in which
                the move is made (see `shape_ramp`).

        Raises:
            Refused: The strain is not finite or beyond the limit.
        """
        self.check(strain)
        two = 0.0 < delay < duration
        ramp = Ramp.build_rate_limited(
            self.strain, strain, duration - two * delay, self.settings.max_rate
        )
        self._begin_motion(shape_ramp(ramp, delay) if two else ramp)

    def follow_profile(self, command: FollowTrajectory, time_unit: float) -> None:
        """Move along a timed profile from the current strain; raises as `plan_profile`."""
        self._begin_motion(plan_profile(command, self.strain, self.settings, time_unit))

    def _begin_motion(self, motion: Motion) -> None:
        self.motion = motion
        self.elapsed = 0.0

    def advance(self, times: Array, ticks: int = 1) -> Array:
        """Return the strain during ticks, shape (ticks m,), and advance past them.

        The bits are the same as tick by tick. `times` are those of the m sub-steps since the
        beginning of a tick; the last is its end.
        """
        if self.is_moving:
            starts = [*accumulate(repeat(float(times[-1]), ticks), initial=self.elapsed)]
            strain = self.motion.strain(np.add.outer(starts[:-1], times).ravel())
            limit = self.settings.max_strain  # a cubic may exceed it by rounding
            np.maximum(np.minimum(strain, limit, out=strain), -limit, out=strain)
            over = bisect_left(starts, self.motion.duration)
            self.elapsed = starts[min(over, ticks)]
        else:
            strain = np.full(ticks * len(times), self.target_strain)
        self.strain = float(strain[-1])
        return strain


MAX_PROFILE_POINTS = 10_000
"""Most points of a profile."""

ROUNDING_TOLERANCE = 1e-9
"""Relative excess over a limit that is rounding, not intent."""


def plan_profile(
    command: FollowTrajectory, strain: float, settings: ActuatorSettings, time_unit: float
) -> Profile:
    """Return the profile that a command asks for, beginning at the present strain; a time unit is
    given in seconds.

    If the first point is later than 0, the profile starts from rest.

    Raises:
        Refused: The points are not a profile, or it exceeds a limit.
    """
    if command.joint != JOINT_NAME:
        raise Refused.out_of_range('joint', command.joint, repr(JOINT_NAME))
    times, strains, rates = _check_points(command)
    longest = 1e12 * time_unit
    if times[-1] > longest:
        raise Refused.out_of_range(
            'times',
            times[-1],
            f'at most {longest:g} s, where a trajectory ends',
        )
    if times[0] > 0.0:
        times, strains = (0.0, *times), (strain, *strains)
        rates = (0.0, *rates) if rates else ()
    elif abs(strains[0] - strain) > ROUNDING_TOLERANCE * settings.max_strain:
        raise Refused(
            ErrorCode.CONFLICT, 'strains', strains[0], f'the present strain {strain:g} at 0 s'
        )
    profile = Profile(
        tuple(time / time_unit for time in times),
        (strain, *strains[1:]),
        tuple(rate * time_unit for rate in rates),
    )
    strongest, fastest = profile.find_extremes()
    rate_name = 'hand_rate' if settings.hand_rate else 'max_rate'
    for name, reached, limit, setting in (
        ('strain', strongest, settings.max_strain, 'max_strain'),
        ('rate', fastest, settings.hand_rate_limit, rate_name),
    ):
        # true for NaN, too
        if len(beyond := np.flatnonzero(~(reached <= limit * (1.0 + ROUNDING_TOLERANCE)))):
            where = int(beyond[0])
            expected = (
                f'within {limit:g} (actuator.{setting}) from {times[where]:g} s to '
                f'{times[where + 1]:g} s'
            )
            raise Refused.out_of_range(f'{name}s', float(reached[where]), expected)
    return profile


def _check_points(command: FollowTrajectory) -> tuple[tuple[float, ...], ...]:
    """Return the columns of the points: times, strains and rates."""
    times, strains, rates = columns = command.times, command.strains, command.rates
    if not 1 <= len(times) <= MAX_PROFILE_POINTS:
        raise Refused.out_of_range('times', len(times), f'1 to {MAX_PROFILE_POINTS} points')
    for name, column in (('strains', strains), ('rates', rates or times)):  # rates may be left out
        if len(column) != len(times):
            expected = f'{len(times)}, one for every point'
            raise Refused(ErrorCode.CONFLICT, name, len(column), expected)
    for name, column in zip(('times', 'strains', 'rates'), columns, strict=True):
        if bad := [value for value in column if not is_number(value, sys.float_info.max)]:
            raise Refused.out_of_range(name, bad[0], 'finite numbers')
    if times[0] < 0.0 or any(late <= early for early, late in itertools.pairwise(times)):
        raise Refused(ErrorCode.CONFLICT, 'times', times, 'rising from 0 s')
    if times[-1] == 0.0:
        raise Refused.out_of_range('times', times[-1], 'later than 0 s at the last point')
    return columns


@dataclass(frozen=True)
class TransmissionState:
    """The state of the transmission.

    Attributes:
        commanded: The last commanded strain.
        encoder_strain: Strain of the motor, read by the encoder.
        strain: Strain of the substrate.
        slipping: Whether the grip slips during the present strain cycle.
    """

    commanded: float = 0.0
    encoder_strain: float = 0.0
    strain: float = 0.0
    slipping: bool = False

    @property
    def is_exact(self) -> bool:
        """Whether the substrate has the commanded strain."""
        return self.commanded == self.encoder_strain == self.strain and not self.slipping


class Transmission:
    """Passes the strain on; exactly, if there is no fault."""

    def __init__(self, settings: ActuatorSettings) -> None:
        """Link an actuator to a substrate, unstrained."""
        self.state = TransmissionState()
        self._settings = settings

    @property
    def encoder_strain(self) -> float:
        """Strain of the motor; the device cannot read that of the substrate."""
        return self.state.encoder_strain

    def advance(self, commanded: Array, dt: Array, faults: Faults, tick: int) -> Array:
        """Return the strain of the substrate at the end of every sub-step of a tick, shape (m,).

        Without a fault, and if the transmission is true, it may be a run of ticks. `commanded` is
        the commanded strain, shape (m,), and `dt` has the lengths of the sub-steps.
        """
        state, last = self.state, float(commanded[-1])
        slipping = self._is_slipping(commanded, faults, tick)
        faulty = slipping or faults.actuator_stuck or faults.actuator_lag or faults.actuator_offset
        if state.is_exact and not faulty:
            if last != state.commanded:
                self.state = TransmissionState(last, last, last)
            return commanded
        motor = self._drive_motor(commanded, dt, faults)
        wanted = np.zeros_like(motor) if slipping else motor
        limits = self._compute_limits(wanted, 0.0 if slipping else state.encoder_strain, dt)
        strain = _follow_course(state.strain, wanted + faults.actuator_offset, limits)
        slipping = slipping and bool(commanded.any())  # the grip holds again after the cycle
        self.state = TransmissionState(last, float(motor[-1]), float(strain[-1]), slipping)
        return strain

    def _is_slipping(self, commanded: Array, faults: Faults, tick: int) -> bool:
        """Return whether the grip slips: drawn when a cycle leaves zero, kept until it returns."""
        may_slip = faults.missed_cycle > 0.0 or self.state.slipping
        if may_slip and self.state.commanded == 0.0 and commanded.any():
            return draw_event(faults.missed_cycle, faults.seed, tick, RandomStream.SLIP)
        return self.state.slipping

    def _drive_motor(self, commanded: Array, dt: Array, faults: Faults) -> Array:
        """Return the strain of the motor at the end of every sub-step."""
        start = self.state.encoder_strain
        if faults.actuator_stuck:
            return np.full_like(commanded, start)
        limits, share = self._compute_limits(commanded, self.state.commanded, dt), None
        if faults.actuator_lag:
            share = 1.0 - exponential(-dt / max(faults.actuator_lag, 1e-9))
        return _follow_course(start, commanded, limits, share)

    def _compute_limits(self, course: Array, before: float, dt: Array) -> Array:
        """Return the largest changes down and up in each sub-step, shape (2, m).

        The change of the course itself plus one by hand, within the rate limit of the actuator.
        """
        moves = np.diff(course, prepend=before)
        by_hand, most = self._settings.hand_rate_limit * dt, self._settings.max_rate * dt
        down = np.maximum(np.minimum(moves, 0.0) - by_hand, -most)
        up = np.minimum(np.maximum(moves, 0.0) + by_hand, most)
        return np.array((down, up))


def _follow_course(
    start: float, wanted: Array, limits: Array, share: Array | None = None
) -> Array:
    """Return a path that follows a course, shape (m,), within the largest changes down and up of
    each sub-step, shape (2, m), and by a share of the remaining way, shape (m,); all by default.
    """
    followed, at = np.empty_like(wanted), start
    shares = np.ones_like(wanted) if share is None else share
    columns = (wanted.tolist(), *limits.tolist(), shares.tolist())
    for k, (goal, down, up, part) in enumerate(zip(*columns, strict=True)):
        way = part * (goal - at)
        if down <= way <= up:
            at = goal if part == 1.0 else at + way
        else:
            at += min(max(way, down), up)
        followed[k] = at
    return followed
