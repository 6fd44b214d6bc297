# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""When ticks of 2 ms are due, and how many of them run together."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from mlmem.loop.mailbox import Mailbox
from mlmem.loop.timetable import WAKE_UP_TIME_S, LoopStatistics, SteadyPacer, Timetable
from mlmem.settings import Settings

PERIOD = 0.002
"""Of a tick: 20 time units of 1e-4 s."""


def timetable(*, speed=1.0, batch=20, heard=True, stream_period=10, **element):
    """Return the times of an element that moves, idle for ever, and what they are taken from."""
    given = {'ticks': 0, 'idle_ticks': math.inf, 'at_rest': False, **element}
    settings = Settings()
    element = SimpleNamespace(tick=settings.time.tick, settings=settings, **given)
    statistics = LoopStatistics()
    times = Timetable(
        element, SteadyPacer(), statistics, speed=speed, batch=batch,
        has_subscribers=lambda: heard, stream_period=lambda: stream_period,
    )  # fmt: skip
    return times, element, statistics


@pytest.mark.parametrize(('speed', 'period'), [(1.0, PERIOD), (4.0, PERIOD / 4.0), (0.0, 0.0)])
def test_period_is_that_of_scale_at_speed(speed, period):
    times, *_ = timetable(speed=speed)
    assert times.period == pytest.approx(period)


@pytest.mark.parametrize(('ticks', 'deferred'), [(0, 19), (7, 12), (19, 0), (20, 19)])
def test_tick_that_is_published_comes_alone_and_on_time(ticks, deferred):
    """40 ms are 20 ticks."""
    times, *_ = timetable(ticks=ticks)
    assert times.deferred(0.0, Mailbox(1.0)) == deferred


def test_no_tick_is_deferred_beyond_next_decision():
    times, element, _ = timetable(idle_ticks=5)
    assert times.deferred(0.0, Mailbox(1.0)) == 5
    element.idle_ticks = 0
    assert times.deferred(0.0, Mailbox(1.0)) == 0


def test_command_takes_effect_in_tick_into_which_it_falls():
    times, *_ = timetable()
    box = Mailbox(1.0)
    box.submit(None)
    assert times.deferred(3.5 * PERIOD, box) == 3
    assert times.deferred(-PERIOD, box) == 0


def test_run_without_listener_ends_at_published_tick():
    """40 ms are 20 ticks and 2 s are 1000, which end anywhere then."""
    times, *_ = timetable(heard=False, ticks=3)
    assert times.deferred(0.0, Mailbox(1.0)) == 17  # to 20
    assert times.limit_run(17) == 7
    times, *_ = timetable(heard=False, stream_period=100, ticks=200)
    assert times.deferred(0.0, Mailbox(1.0)) == 20  # of which none is published
    times, *_ = timetable(heard=False, stream_period=0, ticks=3)
    assert times.deferred(0.0, Mailbox(1.0)) == times.limit_run(20) == 20
    times, *_ = timetable(heard=False, stream_period=0, ticks=3, at_rest=True)
    assert times.deferred(0.0, Mailbox(1.0)) == 1000
    assert times.can_sleep(1000)
    assert not times.can_sleep(20)


def test_deferred_ticks_begin_early_enough_for_next():
    """They take 0.5 ms; as long as their duration is not known, they begin a period before. What
    ticks at rest take does not count.
    """
    times, _, statistics = timetable()
    assert times.wake(1.0, 0) == 1.0
    assert times.wake(1.0, 10) == pytest.approx(1.0 + 9 * PERIOD)
    times.record_duration(5e-5)
    statistics.count(0.0, 1e-9, 10_000)
    assert times.wake(1.0, 10) == pytest.approx(1.0 + 10 * PERIOD - 5e-4 - WAKE_UP_TIME_S)
    assert times.wake(1.0, 100) == pytest.approx(1.0 + 99 * PERIOD)  # its last is due then
    for _ in range(30):
        times.record_duration(1e-4)
    assert times.wake(1.0, 10) == pytest.approx(
        1.0 + 10 * PERIOD - 1e-3 - WAKE_UP_TIME_S, abs=1e-6
    )


@pytest.mark.parametrize(
    ('late', 'skipped'), [(0.0, 0), (0.9, 0), (1.5, 1), (3.2, 3), (19.9, 19), (-50.0, 0)]
)
def test_lost_time_is_skipped_in_whole_ticks(late, skipped):
    """In periods; a procedure decides in every tick, so none may be deferred."""
    times, _, statistics = timetable(idle_ticks=0)
    due = times.after(1.0, 1.0 + (1.0 + late) * PERIOD)
    assert due == pytest.approx(1.0 + (1 + skipped) * PERIOD)
    assert statistics.overruns == skipped


def test_deferred_ticks_may_be_as_late_as_they_may_be_deferred():
    times, _, statistics = timetable()
    assert times.after(1.0, 1.0 + 20.5 * PERIOD) == pytest.approx(1.0 + PERIOD)
    assert statistics.overruns == 0
    times.after(1.0, 1.0 + 22.5 * PERIOD)
    assert statistics.overruns == 21


def test_without_pace_run_takes_no_longer_than_rest():
    times, element, statistics = timetable(speed=0.0, stream_period=100)
    assert times.after(1.0, 7.0) == 7.0
    assert times.longest_run == 1  # nothing is known of its duration
    statistics.count(0.0, 0.001)
    assert times.longest_run == 40
    element.ticks = 80
    assert times.longest_run == 20
    times, element, _ = timetable(speed=0.0, stream_period=0)
    element.at_rest = True
    assert times.longest_run == 1000


def test_lateness_is_plain_mean_first_and_then_forgets():
    """Up to tick 500, the inverse of the later weight of the newest tick."""
    lateness = np.random.default_rng(1).exponential(1e-4, 400)
    statistics = LoopStatistics()
    assert statistics.lateness_deviation == 0.0
    for value in lateness:
        statistics.count(value, 2.0 * value)
    assert statistics.ticks == 400
    assert statistics.lateness_mean == pytest.approx(lateness.mean())
    assert statistics.lateness_deviation == pytest.approx(lateness.std())
    assert statistics.busy == pytest.approx(2.0 * lateness.mean())
    for _ in range(5000):
        statistics.count(0.0, 0.0)
    assert statistics.lateness_mean < 1e-4 * lateness.mean()  # exp(-10)


def test_clock_that_jumps_back_within_tick_counts_as_no_time():
    statistics = LoopStatistics()
    statistics.count(0.0, -4.5)
    assert statistics.busy == 0.0
