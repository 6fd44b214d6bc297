# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The pace of a loop: when ticks run, on a virtual clock; no bit depends on the real one.

`test_runs` holds the property: any cut of time gives the same bits, on time.
"""

import itertools
import math
import time
from types import SimpleNamespace

import numpy as np
import pytest
from rejection import expect_rejection

from mlmem import Abort, Disturb, Loop, SettingsError
from mlmem.loop.mailbox import Mailbox
from mlmem.loop.timetable import LoopStatistics, SteadyPacer, Timetable
from mlmem.settings import Settings

from . import rig
from .loops import PATIENCE, PERIOD, Clock, result, until

pytestmark = pytest.mark.timeout(60)


@pytest.mark.parametrize('speed', [1e-320, 9e-4, -1.0, math.nan, math.inf, 1e7])
def test_speed_at_which_no_tick_would_end_is_rejected(start, speed):
    """A request waits for the end of a tick, and with it an abort."""
    loop = start(rig.device(), speed=1.0)
    with expect_rejection(SettingsError, 'out_of_range', 'time.speed'):
        loop.set_speed(speed)
    assert loop.speed == 1.0
    with pytest.raises(SettingsError):
        Loop(rig.device(), lambda *_: None, speed=speed)


@pytest.mark.parametrize('speed', [1e4, 1e6])
def test_speed_beyond_machine_leaves_no_request_waiting(start, speed):
    """Nobody listens, so 40 ms of time are deferred: at this speed 10^5 ticks and more."""
    loop = start(rig.device(), speed=speed, has_subscribers=lambda: False)
    first = result(loop.call(lambda: loop.element.ticks))
    until(lambda: loop.statistics.ticks > first)
    begun = time.process_time()  # of a processor: others may have it meanwhile
    assert result(loop.submit(Abort())).success
    assert time.process_time() - begun < 5.0  # a few times a thousand ticks


def test_lost_time_is_counted_and_skipped(start):
    """The tick at 0.020 takes 3.75 periods: those due at 0.022 and 0.024 are skipped.

    The one due at 0.026 runs at 0.0275; all later ones are on time.
    """
    clock, begun = Clock(end=0.101), []

    def listen(commands, events):
        begun.append(clock.time)
        if len(begun) == 11:
            clock.time += 3.75 * PERIOD

    loop = start(rig.device(), listen, pacer=clock, speed=1.0)
    until(lambda: len(begun) == 51 - 2)
    time.sleep(0.05)
    assert len(begun) == 51 - 2
    expected = [n * PERIOD for n in range(11)] + [0.0275] + [n * PERIOD for n in range(14, 51)]
    assert begun == pytest.approx(expected, abs=1e-12)
    assert loop.statistics.overruns == 2
    assert loop.element.ticks == 49


def timetable(*, speed=1.0, stream_period=10, heard=True, **element):
    """Return the times of an element that moves and decides nothing, with both it reads."""
    settings, statistics = Settings(), LoopStatistics()
    given = {'ticks': 0, 'idle_ticks': math.inf, 'at_rest': False, **element}
    element = SimpleNamespace(settings=settings, **given)
    times = Timetable(
        element, SteadyPacer(), statistics, speed=speed, batch=20,
        has_subscribers=lambda: heard, stream_period=lambda: stream_period,
    )  # fmt: skip
    return times, element, statistics


@pytest.mark.parametrize(
    ('given', 'deferred'),
    [
        # A tick that is published comes alone; 40 ms are 20 ticks.
        ({'ticks': 7}, 12), ({'ticks': 19}, 0),
        # A procedure decides in the next tick but five, or in the next.
        ({'idle_ticks': 5}, 5), ({'idle_ticks': 0}, 0),
        # Nobody listens: a run ends at a tick that is published, or anywhere if none is.
        ({'heard': False, 'ticks': 3}, 17),
        ({'heard': False, 'ticks': 200, 'stream_period': 100}, 20),
        # At rest nothing is computed: 2 s are 1000 ticks.
        ({'heard': False, 'ticks': 3, 'stream_period': 0, 'at_rest': True}, 1000),
    ],
    ids=str,
)  # fmt: skip
def test_ticks_are_deferred_until_one_matters(given, deferred):
    times, *_ = timetable(**given)
    assert times.count_deferred(0.0, Mailbox(1.0)) == deferred
    assert times.can_sleep(deferred) == (deferred > 20)


def test_deferred_ticks_may_be_as_late_as_they_may_be_deferred():
    times, _, statistics = timetable()
    assert times.schedule_next(1.0, 1.0 + 20.5 * PERIOD) == pytest.approx(1.0 + PERIOD)
    assert statistics.overruns == 0
    times.schedule_next(1.0, 1.0 + 22.5 * PERIOD)
    assert statistics.overruns == 21


def test_run_without_pace_takes_no_longer_than_a_rest():
    """Every hundredth tick is published, and 40 ms are 40 ticks."""
    times, element, statistics = timetable(speed=0.0, stream_period=100)
    assert times.longest_run == 1  # nothing is known of its duration
    statistics.count(0.0, 0.001)
    assert times.longest_run == 40
    element.ticks = 80
    assert times.longest_run == 20


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


UNOBSERVED = {
    'speed': 1.0, 'batch': 20, 'has_subscribers': lambda: False, 'stream_period': lambda: 0,
}  # fmt: skip
"""Options of a loop that nobody listens to."""


def asleep():
    """Return a device at rest, which knows it from a tick that it has computed."""
    element = rig.device()
    rig.ticks(element, 40)
    assert element.at_rest
    return element


@pytest.mark.parametrize('speed', [0.0, 0.5, 10.0])
def test_speed_change_finds_resting_device_in_its_present_tick(start, speed):
    """What it slept through passed at the speed of then: tick 502 was due at 1.004."""
    clock, element = Clock(end=1.0051), asleep()
    loop = start(element, pacer=clock, **UNOBSERVED)
    until(lambda: clock.time == clock.end)
    seen, advance = [], element.advance

    def follow(*given):
        seen.append((element.ticks, loop._times.period))
        return advance(*given)

    element.advance = follow
    loop.set_speed(speed)
    until(lambda: element.ticks >= 40 + 503)
    loop.shut_down()
    assert loop.failure is None
    assert loop.statistics.overruns == 0
    assert seen[0] == (40, PERIOD)
    if speed:
        assert element.ticks == 40 + 503


def test_acceleration_that_arrives_at_rest_wakes_loop(start):
    """Nothing else would, on a clock that wakes nobody by itself."""
    element, clock = asleep(), SteadyPacer()
    clock.wait = lambda changed, seconds: changed.wait(10.0 * PATIENCE)
    loop = start(element, pacer=clock, **UNOBSERVED)
    until(lambda: loop._box.asleep)
    time.sleep(0.01)
    before = element.ticks
    loop.submit(Disturb(1e-6))
    until(lambda: element.ticks > before or not loop._box.asleep)


def test_loop_that_is_paused_before_its_start_runs_no_tick():
    """On a busy machine ticks are overdue before its thread runs: half a second passes whenever
    the clock is read.
    """
    clock = SteadyPacer()
    clock.now = itertools.count(0.0, 0.5).__next__
    loop = Loop(asleep(), lambda *_: None, pacer=clock, **UNOBSERVED)
    paused = loop.pause(True)
    before = loop.element.ticks
    loop.start()
    assert result(paused) == before
    loop.shut_down()


@pytest.mark.parametrize('jump', [-1e9, 1e9])
def test_clock_that_jumps_neither_stops_nor_hurries_loop(start, jump):
    clock, begun = Clock(), []

    def listen(commands, events):
        if len(begun) == 10:
            clock.time += jump
        begun.append(clock.time)

    loop = start(rig.device(), listen, pacer=clock, speed=1.0)
    until(lambda: len(begun) > 60)
    loop.shut_down()
    gaps = [after - before for before, after in itertools.pairwise(begun[12:60])]
    assert gaps == pytest.approx([PERIOD] * len(gaps), abs=1e-6)  # 1e9 s are rounded to 1e-7
