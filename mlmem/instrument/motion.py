# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A strain over time as a value, used by everything that strains an element.

The actuator plays a `Ramp`, which is smooth, or a `Profile`, which goes through timed points. A
`Cycle` is a sequence of ramps and waits: procedures play it tick by tick; analysis and figures
compute its strain in advance. A pulse of any shape is a cycle: `Cycle.build_from_targets([(peak,
400.0), (peak, 60.0), (-0.1 * peak, 20.0), (0.0, 20.0)])`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..errors import Checked, ErrorCode, SettingsError
from ..physics.jit import compile_kernel
from ..physics.values import Array
from ..schema import describe_field, describe_time


@dataclass(frozen=True)
class Ramp:
    """A smooth move, or a wait if start and target are equal.

    Attributes:
        duration: In time units; 0 is a jump.
    """

    start: float
    target: float
    duration: float

    @classmethod
    def build_rate_limited(
        cls, start: float, target: float, duration: float, max_rate: float
    ) -> Ramp:
        """Return a move of a given duration, or longer if the rate limit requires it."""
        # the smooth ramp x^2 (3 - 2 x) has 1.5 times its mean rate at its peak
        least = 1.5 * abs(target - start) / max_rate
        return cls(start, target, max(duration, least))

    @property
    def is_wait(self) -> bool:
        """Whether it is a wait."""
        return self.start == self.target

    def strain(self, t: Array) -> Array:
        """Return the strain at the times since the motion began; the target afterwards."""
        strain = np.array(t, dtype=np.float64)
        _evaluate_ramp(strain.reshape(-1), self.start, self.target, self.duration)
        return strain


@compile_kernel
def _evaluate_ramp(t: Array, start: float, target: float, duration: float) -> None:
    """Replace times by the strains of a ramp."""
    for k in range(len(t)):
        x = t[k] / duration if t[k] < duration else 1.0
        progress = x * x * (3.0 - 2.0 * x)
        t[k] = start + (target - start) * progress if x < 1.0 else target


def shape_ramp(ramp: Ramp, delay: float) -> Profile:
    """Return a smooth move in two half steps, the second of which cancels ringing of the first; it
    takes the delay between them longer.

    The zero-vibration shaper of Singer & Seering (1990, doi 10.1115/1.2894142), without damping:
    an oscillation with a period of twice the delay is left at rest.
    """
    T = ramp.duration
    times = np.unique((0.0, delay, T, T + delay))
    x = np.clip((times - np.array(((0.0,), (delay,)))) / T, 0.0, 1.0)
    way = ramp.target - ramp.start
    strains = ramp.start + way * (x * x * (3.0 - 2.0 * x)).mean(axis=0)
    rates = way / T * (6.0 * x * (1.0 - x)).mean(axis=0)
    return Profile(
        tuple(times.tolist()), (*strains[:-1].tolist(), ramp.target), tuple(rates.tolist())
    )


@dataclass(frozen=True)
class CycleSettings(Checked):
    """One strain cycle: ramp to the peak, hold, ramp back, settle. Ramps are smooth.

    The way back can pause at a fraction of the peak: a wall that was freed quickly swings in a
    well that becomes shallow before it is released.
    """

    ramp: float = describe_time(1200.0, 'ramp to the peak strain', low=1.0)
    hold: float = describe_time(600.0, 'hold at the peak strain')
    ease: float = describe_time(
        0.0, 'ramp from the peak to the pause on the way back; 0: no pause'
    )
    ease_to: float = describe_field(
        0.5, 'strain of that pause, as a fraction of the peak', low=-1.0, high=1.0
    )
    release: float = describe_time(1200.0, 'ramp back to zero strain', low=1.0)
    settle: float = describe_time(1500.0, 'wait after the cycle')


@dataclass(frozen=True)
class Cycle:
    """Ramps and waits in sequence.

    Attributes:
        motions: In order; each begins where the previous one ends.
    """

    motions: tuple[Ramp, ...]

    @classmethod
    def build_from_targets(
        cls, legs: Iterable[tuple[float, float]], start: float = 0.0, max_rate: float = math.inf
    ) -> Cycle:
        """Return the cycle through targets.

        Args:
            legs: Target and duration of each motion; a wait has the present strain as its target.
            start: Strain at the beginning.
            max_rate: Rate limit of the actuator per time unit; ramps that exceed it take longer.
        """
        motions = []
        for target, duration in legs:
            motions.append(Ramp.build_rate_limited(start, target, duration, max_rate))
            start = target
        return cls(tuple(motions))

    @classmethod
    def plan_cycle(cls, times: CycleSettings, peak: float, max_rate: float = math.inf) -> Cycle:
        """Return a strain cycle: up to a peak (negative for compression), hold, back (with an
        optional pause), settle; ramps that exceed the rate limit take longer.
        """
        rise = cls.build_from_targets([(peak, times.ramp), (peak, times.hold)], 0.0, max_rate)
        return rise + cls.plan_release(times, peak, max_rate)

    @classmethod
    def plan_release(
        cls, times: CycleSettings, strain: float, max_rate: float = math.inf
    ) -> Cycle:
        """Return the way back of a strain cycle, from a strain to zero, and the rest after it."""
        ease = [(times.ease_to * strain, times.ease)] if times.ease else []
        return cls.build_from_targets(
            [*ease, (0.0, times.release), (0.0, times.settle)], strain, max_rate
        )

    def __add__(self, other: Cycle) -> Cycle:
        return Cycle(self.motions + other.motions)

    @property
    def duration(self) -> float:
        """Time units from beginning to end."""
        return sum(motion.duration for motion in self.motions)

    @property
    def target(self) -> float:
        """The final strain, which is held."""
        return self.motions[-1].target

    def strain(self, t: Array) -> Array:
        """Return the strain at the times since the cycle began; the target afterwards."""
        return self.profile.strain(t)

    @cached_property
    def profile(self) -> Profile:
        """The cycle as one profile: a smooth ramp is the cubic with zero rate at both ends."""
        times, strains = [0.0], [self.motions[0].start]
        for each in self.motions:
            end = times[-1] + each.duration
            if end > times[-1]:
                times.append(end)
                strains.append(each.target)
            else:  # it takes no time, or less than rounding resolves
                strains[-1] = each.target
        return Profile(tuple(times), tuple(strains), (0.0,) * len(times))


@dataclass(frozen=True)
class Profile:
    """A move of the strain through timed points, segment by segment.

    With rates, a segment is the cubic with the strains and rates of its two points (Hermite);
    without, a straight line: as in `joint_trajectory_controller`.

    Attributes:
        times: Times of the points since the move began in time units: two or more, from 0 on,
            increasing.
        strains: Strains of the points.
        rates: Rates of the points per time unit; empty for straight lines.
    """

    times: tuple[float, ...]
    strains: tuple[float, ...]
    rates: tuple[float, ...] = ()

    def check(self) -> None:
        """Raise `ValueError` unless the points are those of a profile."""
        if not 2 <= len(self.times) == len(self.strains) or len(self.rates) not in (
            0,
            len(self.times),
        ):
            counts = tuple(map(len, (self.times, self.strains, self.rates)))
            expected = 'two or more, with as many strains, and as many rates or none'
            raise SettingsError(ErrorCode.CONFLICT, 'times', counts, expected)
        if self.times[0] != 0.0 or not (np.diff(self.times) > 0.0).all():
            raise SettingsError(ErrorCode.CONFLICT, 'times', self.times, 'increasing from 0')

    @property
    def duration(self) -> float:
        """Time from the first point to the last."""
        return self.times[-1]

    @property
    def target(self) -> float:
        """The final strain, which is held."""
        return self.strains[-1]

    def strain(self, t: Array) -> Array:
        """Return the strain at the times since the move began; the target afterwards."""
        strain = np.array(t, dtype=np.float64)
        _evaluate_cubic(strain.reshape(-1), *self._segments, self.duration, self.target)
        return strain

    @cached_property
    def _segments(self) -> tuple[Array, Array, Array]:
        """Start and width of every segment, and its cubic in the fraction of its width, (4, k)."""
        widths, rise = np.diff(self.times), np.diff(self.strains)
        rates = np.array(self.rates)
        early, late = (widths * rates[:-1], widths * rates[1:]) if self.rates else (rise, rise)
        c3 = (early - rise) + (late - rise)
        c2 = (rise - early) - c3
        return np.array(self.times[:-1]), widths, np.stack((self.strains[:-1], early, c2, c3))

    def find_extremes(self) -> tuple[Array, Array]:
        """Return the greatest magnitudes of strain and rate in every segment, shape (k,) each."""
        with np.errstate(all='ignore'):  # lines have no turning points, steps no finite rate
            _, widths, (c0, c1, c2, c3) = self._segments
            fastest = _clip_turning_points(-c2 / (3.0 * c3))
            root = np.sqrt(c2 * c2 - 3.0 * c1 * c3)
            both = -(c2 + np.copysign(root, c2))  # without cancellation
            turns = (_clip_turning_points(both / (3.0 * c3)), _clip_turning_points(c1 / both))
            ends = (np.zeros_like(c0), np.ones_like(c0))
            strains = [c0 + x * (c1 + x * (c2 + x * c3)) for x in (*ends, *turns)]
            rates = [(c1 + x * (2.0 * c2 + x * 3.0 * c3)) / widths for x in (*ends, fastest)]
        return np.abs(strains).max(axis=0), np.abs(rates).max(axis=0)


@compile_kernel
def _evaluate_cubic(
    t: Array, starts: Array, widths: Array, cubics: Array, duration: float, target: float
) -> None:
    """Replace times, mostly in order, by the strains of a profile."""
    c, j = cubics, 0
    for k in range(len(t)):
        if t[k] < duration:
            if t[k] < starts[j]:
                j = 0
            while j + 1 < len(starts) and starts[j + 1] <= t[k]:
                j += 1
            x = (t[k] - starts[j]) / widths[j]
            t[k] = c[0, j] + x * (c[1, j] + x * (c[2, j] + x * c[3, j]))
        else:
            t[k] = target


def _clip_turning_points(x: Array) -> Array:
    """Return turning points, those outside of their segment or missing moved to its start."""
    return np.where((x > 0.0) & (x < 1.0), x, 0.0)


Motion = Ramp | Profile
"""The motions of an actuator."""
