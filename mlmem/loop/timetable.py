# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""When the ticks of a loop are due, by which clock, how many are deferred and run together, and
how well all that is kept.

A late tick is counted, and the lost time is skipped, not caught up.

Waking up costs more than a tick. So while there is nothing to decide, idle or within a
procedure, ticks are deferred and run several at a time, just before the tick that ends the rest.
That tick, which publishes a stream or resumes the procedure, comes on time. A command ends the
rest and takes effect in the tick into which it falls. Messages of a shaking base do not end the
rest; they are deferred with the ticks and still take effect in their own. Without a pace all
ticks run in batches, each up to the next that the listener waits for.

An element at rest computes nothing, so its ticks cost as little together as one. The loop sleeps
until a command, an acceleration or a stream is due.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from threading import Condition
from typing import Protocol

from .. import threads
from ..element import MemoryElement
from ..errors import SettingsError
from .mailbox import Mailbox


class Pacer(Protocol):
    """A clock to wait on. It may stand still, jump, or run at any rate.

    Attributes:
        slack: Seconds of lag that are caught up; time lost beyond that is skipped. A clock that
            advances in steps needs more than one step.
        jumps: How often the clock has jumped further than that; no time is lost by a jump.
    """

    slack: float
    jumps: int

    def now(self) -> float:
        """Return the time in seconds."""

    def wait(self, changed: Condition, seconds: float) -> None:
        """Wait on a condition, whose lock is held, for at most this time.

        Returns early when the condition is notified, or the clock may have moved.
        """


class SteadyPacer:
    """The steady clock of the machine: lost ticks are not caught up."""

    slack = 0.0
    jumps = 0

    def now(self) -> float:
        """Return the time in seconds."""
        return threads.monotonic()

    def wait(self, changed: Condition, seconds: float) -> None:
        """Wait on a condition for at most this time."""
        changed.wait(seconds)


@dataclass
class LoopStatistics:
    """How the loop keeps time; all times in seconds.

    Attributes:
        ticks: Ticks run.
        overruns: Ticks of wall time that were skipped.
        lateness_mean: Running mean of how late ticks began.
        lateness_variance: Running variance of the same.
        busy: Running mean of the time a tick takes.
    """

    ticks: int = 0
    overruns: int = 0
    lateness_mean: float = 0.0
    lateness_variance: float = 0.0
    busy: float = 0.0

    def count(self, lateness: float, busy: float, ticks: int = 1) -> None:
        """Count ticks of equal times, in seconds; a time is at least 0 if the clock jumps back."""
        busy = max(0.0, busy)
        self.ticks += ticks
        # weight of the newest ticks in the running mean and variance
        weight = max(1.0 - (1.0 - 0.002) ** ticks, ticks / self.ticks)
        deviation = lateness - self.lateness_mean
        self.lateness_mean += weight * deviation
        spread = self.lateness_variance + weight * deviation * deviation
        self.lateness_variance = (1.0 - weight) * spread
        self.busy += weight * (busy - self.busy)

    @property
    def lateness_deviation(self) -> float:
        """Standard deviation of the lateness."""
        return math.sqrt(self.lateness_variance)


MIN_SPEED, MAX_SPEED = 1e-3, 1e6
"""Multiples of real time, beside 0: a request waits for the end of a tick, which must come."""


def check_speed(speed: float) -> float:
    """Return a multiple of real time at which time may run; 0: as fast as possible.

    Raises:
        SettingsError: It is none.
    """
    if speed == 0.0 or MIN_SPEED <= speed <= MAX_SPEED:
        return speed
    raise SettingsError.out_of_range(
        'time.speed',
        speed,
        f'0 (as fast as possible) or from {MIN_SPEED:g} to {MAX_SPEED:g}',
    )


class Timetable:
    """The times of a loop's ticks; for its arguments see `Loop`. All times are in seconds.

    Attributes:
        speed: Multiple of the scale's real time; 0 runs as fast as possible.
        period: Of a tick at this speed; 0 without a pace.
        slept: Whether the loop has slept longer than ticks are deferred otherwise.
        resting: Whether the element rested when `deferred` was asked for the last time.
        max_sleep: Longest sleep of an element at rest.
        max_deferral: Longest time to defer ticks that compute something: a command waits while
            they are made up for.
        max_deferred_ticks: Most ticks to defer: at a speed beyond the machine, none of its time
            would be left otherwise.
    """

    max_sleep = 2.0
    max_deferral = 0.04
    max_deferred_ticks = 1000

    def __init__(
        self,
        element: MemoryElement,
        pacer: Pacer,
        statistics: LoopStatistics,
        *,
        speed: float,
        batch: int,
        has_subscribers: Callable[[], bool],
        stream_period: Callable[[], int],
    ) -> None:
        self._element, self._pacer, self._statistics = element, pacer, statistics
        self._batch, self._has_subscribers = batch, has_subscribers
        self._stream_period = stream_period
        self.slept = self.resting = False
        self._computing = 0.0
        self.set_speed(speed)

    def set_speed(self, speed: float) -> None:
        """Set the period of a tick, and with it how many ticks a rest may defer."""
        self.speed = speed
        tick_seconds = self._element.settings.tick_seconds
        self.period = period = tick_seconds / speed if speed > 0.0 else 0.0
        self._most_deferred, self._most_asleep = (
            int(min(self.max_deferred_ticks, longest / period)) if period else 0
            for longest in (self.max_deferral, self.max_sleep)
        )
        longest = self.max_deferral + 1e-9  # tolerates rounding
        self._at_once = max(
            ticks
            for ticks in range(1, self._batch + 1)
            if ticks == 1 or (self._batch % ticks == 0 and 0.0 < ticks * period <= longest)
        )

    def count_deferred(self, late: float, box: Mailbox) -> int:
        """Return how many ticks to run together if the next is late by a given time; 0 if none.

        A pending request in the box makes them end where it takes effect.
        """
        element = self._element
        resting, every = element.at_rest, self._stream_period()
        self.resting = resting
        if every and (resting or self._has_subscribers()):
            in_time = self._at_once - element.ticks % self._at_once
            ticks = in_time if resting and self._at_once > 1 else in_time - 1
        elif resting and not box.shakes:
            ticks = self._most_asleep
        else:
            ticks = self._most_deferred
            if every:
                beyond = (element.ticks + ticks) % every
                ticks -= beyond if beyond < ticks else 0
        if self.slept:
            ticks = max(ticks, min(self._most_asleep, self._count_passed(late)))
        ticks = min(ticks, element.idle_ticks)
        pending = box.commands or box.calls
        return min(ticks, self._count_passed(late)) if ticks and pending else ticks

    def _count_passed(self, late: float) -> int:
        return int(max(0.0, late) / self.period)

    def find_wake_time(self, due: float, deferred: int) -> float:
        """Return when to begin with the `deferred` ticks, the first due at a given time.

        As long before the next one as they take, so that one wake-up serves both, and a procedure
        goes on in time; at most a period. Of an element at rest the last one may be a tick that
        somebody waits for.
        """
        if not deferred:
            return due
        known = self._computing > 0.0 and not self.resting
        wake_up = 2e-4  # seconds that the processor takes to come back to deferred ticks
        busy = deferred * self._computing + wake_up if known else self.period
        return due + deferred * self.period - min(busy, self.period)

    def record_duration(self, busy: float) -> None:
        """Learn what a deferred tick has taken that computed something, in seconds."""
        weight = 0.2 if self._computing else 1.0  # weight of the newest ticks in the running mean
        self._computing += weight * (busy - self._computing)

    def can_sleep(self, deferred: int) -> bool:
        """Return whether so many ticks are deferred only at rest."""
        return deferred > self._most_deferred

    def schedule_next(self, due: float, now: float) -> float:
        """Return when the next tick is due; count and skip lost time."""
        if self.period == 0.0:
            return now
        lag = now - (due + self.period)
        borne = max(self.period, self._pacer.slack)
        if lag > borne and self._element.idle_ticks:  # deferred ticks may be late
            deferred = self._at_once > 1 if self._has_subscribers() else self._most_deferred > 0
            borne = max(borne, self.max_deferral if deferred else 0.0)
        skipped = int(lag / self.period) if lag > borne else 0
        self._statistics.overruns += skipped
        return due + (1 + skipped) * self.period

    def limit_run(self, ticks: int) -> int:
        """Return how many of these ticks to run until the listener is told."""
        every = self._stream_period()
        return min(ticks, every - self._element.ticks % every) if every else ticks

    @property
    def longest_run(self) -> int:
        """Ticks of a run without a pace: it delays a command no longer than a rest would."""
        if self._element.at_rest and not self._stream_period():
            return self.max_deferred_ticks
        busy = self._statistics.busy
        return max(1, self.limit_run(int(self.max_deferral / busy) if busy > 0.0 else 1))
