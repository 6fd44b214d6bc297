# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The loop: when ticks run, on a virtual clock; and that bits do not depend on the real one.

A `Clock` advances when the loop sleeps and when a tick of a test is slow, and stops at its end, so
that the expected times are exact.
"""

import itertools
import math
import threading
import time
from concurrent.futures import wait
from unittest.mock import Mock

import pytest

from mlmem_ros.device import (
    Abort,
    Calibrate,
    Disturb,
    EchoReceived,
    Erase,
    Faults,
    Inject,
    Loop,
    Outcome,
    Read,
    Refused,
    SetStrain,
    SettingsError,
    Write,
    snapshot,
)
from mlmem_ros.device.mailbox import MOST
from mlmem_ros.device.settings import ScaleSettings
from mlmem_ros.device.timetable import SteadyPacer
from mlmem_ros.physics import StateError

from . import rig

PERIOD = 0.002
"""Of a tick: 20 time units of 1e-4 s."""

PATIENCE = 60.0
"""Seconds a test waits for what has to come; on a loaded machine it takes a while."""

pytestmark = pytest.mark.timeout(60)


class Clock:
    """A clock that advances while somebody sleeps on it, up to an end where it stops."""

    slack = 0.0

    def __init__(self, end=math.inf):
        self.time = 0.0
        self.end = end

    def now(self):
        return self.time

    def wait(self, changed, seconds):
        if self.time >= self.end:
            changed.wait(1e-3)
        else:
            self.time = min(self.time + seconds, self.end)


def until(condition):
    """Wait until a condition holds."""
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline, 'it did not come true'
        time.sleep(1e-3)


def restless(**settings):
    """Return a device whose material never rests, so that its ticks have to be computed."""
    element = rig.device(**settings)
    element.driver.at_rest = lambda _: False
    return element


@pytest.fixture
def start():
    """Start loops, by default as fast as possible, and stop them after the test."""
    loops = []

    def start(element, listener=lambda commands, events: None, *, speed=0.0, **options):
        loop = Loop(element, listener, speed=speed, **options)
        loops.append(loop)
        loop.start()
        return loop

    yield start
    for loop in loops:
        loop.stop()


def result(asked):
    """Return the answer to a request, or the result of a future."""
    return getattr(asked, 'answer', asked).result(PATIENCE)


def refusal(asked):
    error = getattr(asked, 'answer', asked).exception(PATIENCE)
    assert isinstance(error, Refused)
    return str(error)


def hold(loop):
    """Pause a loop after the tick in progress; return the ticks done."""
    return result(loop.pause(True))


# --- when ticks run ---------------------------------------------------------------------------


def test_ticks_come_at_the_period(start):
    clock, begun = Clock(end=0.201), []
    loop = start(rig.device(), lambda *_: begun.append(clock.time), pacer=clock, speed=1.0)
    until(lambda: len(begun) == 101)
    loop.stop()
    assert begun == pytest.approx([n * PERIOD for n in range(101)], abs=1e-12)
    assert loop.statistics.ticks == loop.element.ticks == 101
    assert loop.statistics.overruns == 0
    assert loop.statistics.lateness_mean == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(('speed', 'period'), [(2.0, 0.001), (0.1, 0.02)])
def test_speed_is_a_factor_on_real_time(start, speed, period):
    clock, begun = Clock(), []
    start(rig.device(), lambda *_: begun.append(clock.time), pacer=clock, speed=speed)
    until(lambda: len(begun) >= 11)
    assert begun[:11] == pytest.approx([n * period for n in range(11)], abs=1e-12)


def test_the_scale_sets_the_pace(start):
    clock, begun = Clock(end=10.5), []
    element = rig.device(scale=ScaleSettings(time=0.05))
    start(element, lambda *_: begun.append(clock.time), pacer=clock, speed=1.0)
    until(lambda: len(begun) == 11)
    assert begun == pytest.approx([float(n) for n in range(11)], abs=1e-9)


def test_the_ticks_of_an_idle_device_run_together(start):
    """Four run when the fourth is due; the fifth, which a listener waits for, runs on time."""
    clock, begun = Clock(end=0.0481), []
    loop = start(restless(), lambda *_: begun.append(clock.time), pacer=clock, speed=1.0, batch=5)
    until(lambda: len(begun) == 25)
    loop.stop()
    expected = [(5 * (n // 5) + (4 if n % 5 == 4 else 3)) * PERIOD for n in range(25)]
    assert begun == pytest.approx(expected, abs=1e-12)
    assert loop.statistics.overruns == 0
    assert loop.statistics.lateness_mean == pytest.approx(0.0, abs=1e-12)


def test_a_command_ends_a_rest_and_takes_effect_in_its_own_tick(start):
    """At 0.0151 tick 5 would wait until 0.016; the present tick is 7, due at 0.014."""
    clock, begun, stamped = Clock(end=0.0081), [], []

    def listen(commands, _):
        begun.append(clock.time)
        stamped.extend(commands)

    loop = start(rig.device(), listen, pacer=clock, speed=1.0, batch=5)
    until(lambda: len(begun) == 5)
    clock.end = clock.time = 0.0151
    loop.submit(SetStrain(0.03))
    until(lambda: len(begun) == 8)
    assert begun == pytest.approx([0.006] * 4 + [0.008] + [0.0151] * 3)
    assert stamped == [(7, SetStrain(0.03))]
    clock.end = 0.0301  # the strain is on its way, and nobody is told before ticks 10 and 15
    until(lambda: len(begun) == 15)
    assert begun[8:] == pytest.approx([0.016, 0.018] + [0.026] * 4 + [0.028], abs=1e-12)


@pytest.mark.parametrize(('late', 'overruns', 'following'), [(0.03, 0, 0.078), (0.051, 24, 0.126)])
def test_a_rest_that_ends_late_is_a_longer_rest(start, late, overruns, following):
    """The late ticks run with the next; beyond 0.04 s they are skipped."""
    clock, begun = Clock(end=0.15), []

    def listen(*_):
        begun.append(clock.time)
        if len(begun) == 20:
            clock.time += late

    loop = start(restless(), listen, pacer=clock, speed=1.0, batch=20)
    until(lambda: len(begun) >= 40)
    assert loop.statistics.overruns == overruns
    assert begun[20:40] == pytest.approx([following - PERIOD] * 19 + [following])


@pytest.mark.parametrize('speed', [1e-320, 9e-4, -1.0, math.nan, math.inf, 1e7])
def test_a_speed_at_which_no_tick_would_end_is_refused(start, speed):
    """A request waits for the end of a tick, and with it an abort."""
    loop = start(rig.device(), speed=1.0)
    with pytest.raises(SettingsError, match=r'must be 0 .* or from 0\.001 to 1e\+06'):
        loop.set_speed(speed)
    assert loop.speed == 1.0
    with pytest.raises(SettingsError):
        Loop(rig.device(), lambda *_: None, speed=speed)


@pytest.mark.parametrize(('speed', 'together'), [(1.0, 20), (0.5, 10), (0.4, 5), (0.01, 1)])
def test_a_rest_is_short_and_ends_with_a_published_tick(start, speed, together):
    """At most 0.04 s, and a divisor of the 20 ticks."""
    clock, begun = Clock(), []
    start(restless(), lambda *_: begun.append(clock.time), pacer=clock, speed=speed, batch=20)
    until(lambda: len(begun) >= 40)
    rests = [1] * 20 if together == 1 else [together - 1, 1] * (20 // together)
    assert [begun.count(time) for time in sorted(set(begun[:20]))] == rests


def test_a_listener_is_called_at_published_ticks_with_the_same_bits(start):
    """Of 20 ticks 10 run together, then 9, then the one that the listener waits for.

    So too while the strain moves, except for the tick in which it began.
    """
    clock, heard = Clock(end=0.1191), []  # tick 60 is due at 0.118
    element, other = restless(), restless()

    def listen(*_):
        heard.append(element.ticks)

    loop = start(element, listen, pacer=clock, speed=1.0, batch=20, stream_period=lambda: 10)
    until(lambda: len(heard) >= 9)
    loop.submit(SetStrain(0.03))
    clock.end = 0.2
    until(lambda: len(heard) >= 13)
    loop.stop()
    assert heard[:9] == [10, 19, 20, 30, 39, 40, 50, 59, 60]
    assert heard[9:13] == [61, 70, 79, 80]
    for tick in range(element.ticks):
        if tick == 60:
            other.apply(SetStrain(0.03))
        other.advance()
    assert snapshot.take(element) == snapshot.take(other)


@pytest.mark.parametrize('faults', [Faults(), Faults(sensor_noise=1e-5, seed=3)])
def test_ticks_of_a_rest_equal_single_ticks(faults):
    """After a strain by hand, while the element still rings: the whole state."""
    devices = rig.device(), rig.device()
    for device in devices:
        device.set_faults(faults)
        device.apply(SetStrain(0.01))
        while not device.still:
            device.advance()
    rested, other = devices
    for ticks in (1, 10, 3):
        rested.advance(ticks)
        for _ in range(ticks):
            other.advance()
        assert snapshot.take(rested) == snapshot.take(other)
        assert rested.substrate_speed == other.substrate_speed == 0.0


def test_all_ticks_are_deferred_while_nobody_listens(start):
    """Twenty, in runs of ten; when somebody listens again, tick 30 is on time."""
    clock, element, heard, told = Clock(end=0.0381), restless(), [], []
    start(
        element, lambda *_: told.append((element.ticks, clock.time)),
        pacer=clock, speed=1.0, batch=10, stream_period=lambda: 10,
        has_subscribers=lambda: bool(heard),
    )  # fmt: skip
    until(lambda: len(told) == 2)
    heard.append('somebody')
    clock.end = 0.0581
    until(lambda: len(told) == 4)
    ticks, times = zip(*told, strict=True)
    assert ticks == (10, 20, 29, 30)
    assert times == pytest.approx([0.038] * 2 + [0.056, 0.058], abs=1e-12)


def test_lost_time_is_skipped_while_nobody_listens_too(start):
    """The machine slept for ten seconds, which are counted and skipped."""
    clock = Clock(end=0.0381)
    loop = start(restless(), pacer=clock, speed=1.0, batch=10, has_subscribers=lambda: False)
    until(lambda: loop.element.ticks == 20)
    clock.end = clock.time = 10.0381
    until(lambda: loop.element.ticks == 40)
    clock.end = 10.0401
    time.sleep(0.05)
    assert loop.element.ticks == 40
    assert loop.statistics.overruns == pytest.approx(4980, abs=1)


def asleep(ticks=40):
    """Return a device at rest, which knows it from a tick that it has computed."""
    element = rig.device()
    rig.ticks(element, ticks)
    assert element.at_rest
    return element


def test_a_device_at_rest_wakes_for_published_ticks_alone(start):
    """All twenty run when the last is due, which the listener waits for."""
    clock, told, element = Clock(), [], asleep()
    start(
        element, lambda *_: told.append((element.ticks, clock.time)),
        pacer=clock, speed=1.0, batch=20, stream_period=lambda: 20,
    )  # fmt: skip
    until(lambda: len(told) >= 4)
    assert told[:4] == [
        (40 + 20 * n, pytest.approx(0.04 * n - PERIOD, abs=1e-12)) for n in (1, 2, 3, 4)
    ]


def test_a_device_at_rest_sleeps_while_nobody_watches(start):
    """For two seconds; then a call finds it in the present tick, and a command in its own."""
    clock, element, told = Clock(end=3.0051), asleep(), []
    loop = start(
        element, lambda commands, _: told.append((element.ticks, clock.time, *commands)),
        pacer=clock, speed=1.0, batch=20,
        has_subscribers=lambda: False, stream_period=lambda: 0,
    )  # fmt: skip
    until(lambda: clock.time == clock.end)
    assert told == [(1040, pytest.approx(1.998))]
    assert result(loop.call(lambda: element.ticks)) == 40 + 1502
    loop.submit(SetStrain(0.03))
    until(lambda: len(told) >= 2 and told[-1][2:])
    assert told[-1][2:] == ((40 + 1502, SetStrain(0.03)),)
    assert loop.statistics.overruns == 0


@pytest.mark.parametrize('speed', [0.0, 0.5, 10.0])
def test_a_changed_speed_finds_a_device_at_rest_in_its_present_tick(start, speed):
    """What it slept through passed at the speed of then: tick 502 was due at 1.004."""
    clock, element = Clock(end=1.0051), asleep()
    loop = start(
        element, pacer=clock, speed=1.0, batch=20,
        has_subscribers=lambda: False, stream_period=lambda: 0,
    )  # fmt: skip
    until(lambda: clock.time == clock.end)
    seen, advance = [], element.advance

    def follow(*given):
        seen.append((element.ticks, loop._times.period))
        return advance(*given)

    element.advance = follow
    loop.set_speed(speed)
    until(lambda: element.ticks >= 40 + 503)
    loop.stop()
    assert loop.failure is None
    assert loop.statistics.overruns == 0
    assert seen[0] == (40, PERIOD)
    if speed:
        assert element.ticks == 40 + 503


def test_an_acceleration_wakes_a_device_at_rest(start):
    """It takes effect in the tick in which it arrives, and the bits are those of single ticks."""
    clock, element, other, stamped = Clock(end=1.0051), asleep(), asleep(), []
    loop = start(
        element, lambda commands, _: stamped.extend(commands),
        pacer=clock, speed=1.0, batch=20,
        has_subscribers=lambda: False, stream_period=lambda: 0,
    )  # fmt: skip
    until(lambda: clock.time == clock.end)
    loop.submit(Disturb(1e-6))
    until(lambda: element.ticks == 40 + 502)  # it is up, and defers ticks as a shaken device
    clock.end = 1.3
    until(lambda: element.ticks >= 640)
    assert stamped == [(40 + 502, Disturb(1e-6))]
    loop.stop()
    while other.ticks < element.ticks:
        if other.ticks == 40 + 502:
            other.apply(Disturb(1e-6))
        other.advance()
    assert snapshot.take(element) == snapshot.take(other)
    assert loop.statistics.overruns == 0


class Sleeper(SteadyPacer):
    """A clock on which who is not woken sleeps on."""

    def wait(self, changed, seconds):
        changed.wait(10.0 * PATIENCE)


def test_an_acceleration_that_arrives_at_rest_wakes_the_loop(start):
    """Nothing else would, on a clock that wakes nobody by itself."""
    element = asleep()
    loop = start(
        element, pacer=Sleeper(), speed=1.0, batch=20,
        has_subscribers=lambda: False, stream_period=lambda: 0,
    )  # fmt: skip
    until(lambda: loop._box.asleep)
    time.sleep(0.01)
    before = element.ticks
    loop.submit(Disturb(1e-6))
    until(lambda: element.ticks > before or not loop._box.asleep)


def test_a_device_at_rest_runs_a_thousand_ticks_at_once_without_a_pace(start):
    element, told = asleep(), []
    loop = start(element, lambda *_: told.append(element.ticks), speed=0.0,
                 stream_period=lambda: 0)  # fmt: skip
    until(lambda: len(told) >= 5)
    loop.stop()
    assert {b - a for a, b in itertools.pairwise(told)} == {1000}


@pytest.mark.parametrize('speed', [1e4, 1e6])
def test_a_speed_beyond_the_machine_leaves_no_request_waiting(start, speed):
    """Nobody listens, so 40 ms of time are deferred: at this speed 10^5 ticks and more."""
    loop = start(rig.device(), speed=speed, has_subscribers=lambda: False)
    first = result(loop.call(lambda: loop.element.ticks))
    until(lambda: loop.statistics.ticks > first)
    begun = time.process_time()  # of a processor: others may have it meanwhile
    assert result(loop.submit(Abort())).success
    assert time.process_time() - begun < 5.0  # a few times a thousand ticks


def test_a_procedure_resumes_on_time_and_ticks_between_are_deferred(start):
    """It takes as many ticks as tick by tick, and the loop wakes a fifth as often."""

    def write(batch):
        clock, woken = Clock(), set()
        loop = start(
            rig.device(1), lambda *_: woken.add(clock.time), pacer=clock, speed=1.0, batch=batch
        )
        outcome = result(loop.submit(Write(3)))
        loop.stop()
        assert loop.statistics.overruns == 0
        begin, end = outcome.start_tick, outcome.end_tick  # before and after it time runs on
        often = sum(begin <= round(at / PERIOD) <= end for at in woken)
        return (end - begin, outcome.reading.delay), often

    (by_ticks, often), (put_off, seldom) = write(1), write(20)
    assert put_off == by_ticks
    assert seldom < 0.2 * often


def test_messages_of_the_base_end_no_rest_and_take_effect_in_their_tick(start):
    """Messages at 0.0031, 0.0051, 0.0052 and 0.0101 belong to ticks 1, 2, 2 and 5; the newest
    counts. The deferred ticks are one run all the same.
    """
    clock, begun, stamped = Clock(end=0.001), [], []

    def listen(commands, _):
        begun.append(clock.time)
        stamped.extend(commands)

    loop = start(rig.device(), listen, pacer=clock, speed=1.0, batch=10, stream_period=lambda: 10)
    for now, size in ((0.0031, 1), (0.0051, 2), (0.0052, 3), (0.0101, 4)):
        clock.end = clock.time = now
        loop.submit(Disturb(1e-6 * size))
    clock.end = 0.0181
    until(lambda: loop.element.ticks == 10)
    assert stamped == [(tick, Disturb(1e-6 * size)) for tick, size in ((1, 1), (2, 3), (5, 4))]
    assert begun == pytest.approx([0.016, 0.018], abs=1e-12)


def test_deferred_ticks_are_done_just_as_the_next_is_due(start):
    """A tick takes 0.1 ms: a run of nine begins 0.9 ms before the tenth, and does not delay it.

    Before it is known how long they take, a run begins a period before that tick.
    """
    clock, begun, element = Clock(end=0.06), [], restless()

    def listen(*_):
        begun.append(clock.time)
        clock.time += 1e-4 * (9 if element.ticks % 10 == 9 else 1)

    loop = start(element, listen, pacer=clock, speed=1.0, batch=10, stream_period=lambda: 10)
    until(lambda: element.ticks == 30)
    loop.stop()
    expected = [0.016, 0.018, 0.0371, 0.038, 0.0571, 0.058]
    assert begun == pytest.approx(expected, abs=1e-12)


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


def test_a_loop_that_is_always_late_does_not_sprint(start):
    """Every tick takes 1.6 periods: they run back to back, and the lost ones are counted."""
    clock, begun = Clock(), []

    def listen(commands, events):
        begun.append(clock.time)
        clock.time += 1.6 * PERIOD

    loop = start(rig.device(), listen, pacer=clock, speed=1.0)
    until(lambda: len(begun) > 100)
    loop.stop()
    gaps = [after - before for before, after in itertools.pairwise(begun)]
    assert min(gaps) >= 1.6 * PERIOD - 1e-12
    due = (begun[-1] + 1.6 * PERIOD) / PERIOD
    assert loop.statistics.overruns == pytest.approx(due - len(begun), abs=2.0)


def test_the_steps_of_a_coarse_clock_are_caught_up(start):
    """A simulator's clock with steps of five periods: within its slack no tick is lost."""
    period = 20 * 2.0**-13  # so that all sums are exact
    clock, begun = Clock(), []
    clock.slack = 10 * period
    clock.wait = lambda changed, seconds: setattr(clock, 'time', clock.time + 5 * period)
    element = rig.device(scale=ScaleSettings(time=2.0**-13))
    loop = start(element, lambda *_: begun.append(clock.time), pacer=clock, speed=1.0)
    until(lambda: len(begun) > 50)
    loop.stop()
    assert begun[:51] == [0.0] + [5 * period * (1 + n // 5) for n in range(50)]
    assert loop.statistics.overruns == 0


@pytest.mark.parametrize('jump', [-1e9, 1e9])
def test_a_clock_that_jumps_neither_stops_the_loop_nor_makes_it_sprint(start, jump):
    clock, begun = Clock(), []

    def listen(commands, events):
        if len(begun) == 10:
            clock.time += jump
        begun.append(clock.time)

    loop = start(rig.device(), listen, pacer=clock, speed=1.0)
    until(lambda: len(begun) > 60)
    loop.stop()
    gaps = [after - before for before, after in itertools.pairwise(begun[12:60])]
    assert gaps == pytest.approx([PERIOD] * len(gaps), abs=1e-6)  # 1e9 s are rounded to 1e-7


def test_the_real_clock_paces_too(start):
    """A tick every 20 ms for half a second; a loaded machine is late and skips, never early."""
    element = rig.device(scale=ScaleSettings(time=1e-3))
    begun, started = [], time.monotonic()
    loop = start(element, lambda *_: begun.append(time.monotonic()), speed=1.0)
    until(lambda: len(begun) + loop.statistics.overruns >= 25)
    loop.stop()
    assert len(begun) + loop.statistics.overruns <= (time.monotonic() - started) / 0.02 + 2
    assert begun[-1] - begun[0] >= (len(begun) - 1 - 1) * 0.02 - 0.005


# --- the same whatever the pace ---------------------------------------------------------------


@pytest.mark.parametrize(('speed', 'batch'), [(0.0, 1), (40.0, 1), (40.0, 20)])
def test_a_loop_computes_the_same_as_stamped_commands_by_hand(start, speed, batch):
    """The clock decides in which ticks commands take effect; the stamps record them."""
    stamped, heard, aborted = [], [], []

    def listen(commands, events):
        stamped.extend(commands)
        heard.extend(str(event) for event in events)
        if Write(3) in [command for _, command in commands]:  # before the write can end
            aborted.append(loop.submit(Abort()))

    loop = start(rig.device(0), listen, speed=speed, batch=batch)
    assert result(loop.submit(Write(1))).success
    assert result(loop.submit(SetStrain(0.02))) is None
    time.sleep(0.01)
    assert result(loop.submit(Write(3))).error == 'aborted'
    assert result(aborted[0]).success
    assert result(loop.submit(Read('right'))).procedure == 'read'
    loop.stop()

    by_hand, again = rig.device(0), []
    commands = [command for _, command in stamped]
    assert commands == [Write(1), SetStrain(0.02), Write(3), Abort(), Read('right')]
    while by_hand.ticks < loop.element.ticks:
        for when, command in stamped:
            if when == by_hand.ticks:
                by_hand.apply(command)
        again += [str(event) for event in by_hand.advance()]
    assert again == heard
    assert rig.bits(by_hand) == rig.bits(loop.element)


# --- pause and single ticks -------------------------------------------------------------------


def test_a_paused_device_does_not_move(start):
    loop = start(rig.device(2), speed=0.1)
    loop.submit(SetStrain(0.08))  # the longest way: 1.2 s, for machines that are busy, too
    until(lambda: loop.element.ticks > 3)
    assert not loop.paused
    ticks = hold(loop)
    assert loop.paused
    before = rig.bits(loop.element)
    assert loop.element.actuator.moving
    time.sleep(0.05)
    assert loop.element.ticks == ticks
    assert rig.bits(loop.element) == before
    loop.pause(False)
    until(lambda: loop.element.ticks > ticks + 3)
    assert loop.statistics.overruns == 0 or loop.statistics.lateness_mean > 0.0


def test_no_tick_runs_after_a_pause_between_two_readings_of_the_clock(start):
    clock = Clock(end=0.021)  # after the 11th tick, before the 12th is due
    loop = start(rig.device(), pacer=clock, speed=1.0)
    until(lambda: loop.element.ticks == 11)
    paused = threading.Event()

    def now():
        if not paused.is_set():  # the loop looks whether the next tick is due
            loop.pause(True)
            paused.set()
        return clock.time

    clock.now = now
    assert paused.wait(PATIENCE)
    time.sleep(0.02)
    assert loop.element.ticks == 11


def test_a_call_during_a_pause_lets_no_tick_run(start):
    """A single tick may take long: the time until the call is no rest whose ticks are missing."""
    clock, stepping, counted = Clock(end=0.021), threading.Event(), []

    def listen(*_):
        if stepping.is_set():
            clock.time += 10 * PERIOD
            counted.append(loop.pause(True))

    loop = start(rig.device(), listen, pacer=clock, speed=1.0, has_subscribers=lambda: False)
    ticks = hold(loop)
    stepping.set()
    assert result(loop.step().answer) == ticks + 1
    assert result(counted[0]) == ticks + 1


def test_a_script_that_is_injected_during_a_pause_begins_with_the_next_tick(start):
    loop, script = start(rig.device()), '[{"unit": "actuator", "failure": "stuck"}]'
    hold(loop)
    assert result(loop.submit(Inject(script))) is None
    assert not loop.element.faults.active()
    result(loop.step().answer)
    assert loop.element.faults.active() == {'actuator_stuck': True}


def test_a_pause_counts_the_tick_in_progress(start):
    begun, end = threading.Event(), threading.Event()

    def tick(*_):
        begun.set()
        end.wait(PATIENCE)

    loop = start(rig.device(), tick)
    assert begun.wait(PATIENCE)
    held = loop.pause(True)
    assert not held.done()
    end.set()
    assert result(held) == loop.element.ticks
    assert result(loop.step().answer) == result(held) + 1


def test_finishing_a_loop_that_was_never_started_ends_at_once():
    loop = Loop(rig.device(), lambda *_: None)
    loop.finish()
    assert 'shut down' in refusal(loop.pause(True))


def test_a_pause_is_not_an_overrun(start):
    clock = Clock()
    loop = start(rig.device(), lambda *_: time.sleep(1e-4), pacer=clock, speed=1.0)
    until(lambda: loop.element.ticks > 3)
    hold(loop)
    clock.time += 100.0
    loop.pause(False)
    ticks = loop.element.ticks
    until(lambda: loop.element.ticks > ticks + 3)
    assert loop.statistics.overruns == 0


def test_single_ticks_are_single(start):
    loop = start(rig.device())
    ticks = hold(loop)
    for n in range(1, 6):
        assert result(loop.step().answer) == ticks + n
    many = [loop.step().answer for _ in range(10)]
    assert [result(tick) for tick in many] == [ticks + 6 + n for n in range(10)]
    time.sleep(0.02)
    assert loop.element.ticks == ticks + 15


def test_a_slow_machine_makes_up_for_no_tick_while_time_is_paused(start):
    """Every look at the clock takes two periods, also between a call and the next."""

    class Slow(Clock):
        def now(self):
            self.time += 2 * PERIOD
            return self.time

    loop = start(rig.device(), pacer=Slow(), speed=1.0, batch=10)
    ticks = hold(loop)
    for n in range(1, 100):
        assert result(loop.step().answer) == ticks + n
        assert hold(loop) == ticks + n


def test_single_ticks_do_not_wait_for_the_clock(start):
    clock = Clock(end=0.0201)
    loop = start(rig.device(), pacer=clock, speed=1.0)
    until(lambda: loop.element.ticks == 11)
    ticks = hold(loop)
    assert [result(tick) for tick in [loop.step().answer for _ in range(5)]][-1] == ticks + 5


def test_a_command_waits_for_the_single_tick(start):
    stamped = []
    loop = start(rig.device(), lambda commands, events: stamped.extend(commands))
    ticks = hold(loop)
    answer = loop.submit(SetStrain(0.01)).answer
    time.sleep(0.02)
    assert not answer.done()
    result(loop.step().answer)
    assert result(answer) is None
    assert stamped == [(ticks, SetStrain(0.01))]
    assert loop.element.actuator.moving


def test_a_single_tick_of_a_running_loop_is_refused(start):
    loop = start(rig.device())
    assert refusal(loop.step().answer) == 'step works only while paused; pause first'


def test_a_single_tick_is_answered_even_if_the_pause_ends_first(start):
    loop = start(rig.device())
    hold(loop)
    blocked = threading.Event()
    holding = loop.call(blocked.wait)  # the loop's thread is busy until we let it
    tick = loop.step().answer
    loop.pause(False)
    blocked.set()
    result(holding)
    assert result(tick) > 0


# --- commands and answers ---------------------------------------------------------------------


def test_a_fault_of_the_program_in_a_command_is_its_answer_and_ends_the_loop(start):
    element, fault = rig.device(), RuntimeError('a fault of the program')
    element.apply = Mock(side_effect=fault)
    loop = start(element)
    assert loop.submit(Read()).answer.exception(PATIENCE) is fault
    until(lambda: loop.failure is fault)
    assert refusal(loop.submit(Read())) == f'the device has stopped: {fault}'


def test_a_procedure_is_answered_when_it_ends(start):
    events = []
    loop = start(rig.device(1), lambda _, told: events.extend(told))
    outcome = result(loop.submit(Write(2)))
    assert isinstance(outcome, Outcome)
    assert outcome.success
    assert outcome.reading.level == 2
    loop.stop()
    assert [type(event) for event in events] == 4 * [EchoReceived] + [Outcome]
    assert events[-1] is outcome
    assert rig.holds(loop.element, 2)


def test_a_procedure_is_answered_after_its_outcome_was_published(start):
    """Or a client would still find the old level on ~/level."""
    answered = []

    def publish(commands, events):
        answered.extend(answer.done() for event in events if isinstance(event, Outcome))

    loop = start(rig.device(), publish)
    hold(loop)
    answer = loop.submit(Read()).answer
    loop.pause(False)
    assert result(answer).success
    assert answered == [False]


def test_refusals_reach_the_requester_and_are_counted(start):
    loop = start(rig.device())
    asked = [SetStrain(math.nan), Write(9), Read('top'), SetStrain('x'), 'nonsense']
    answers = [loop.submit(command) for command in asked]
    assert 'strain must be a finite number' in refusal(answers[0])
    assert 'level must be a whole number from 0 to 3; got 9' in refusal(answers[1])
    for answer in answers[2:]:
        assert 'must be' in refusal(answer)
    assert loop.statistics.refused == 5
    assert loop.failure is None
    assert result(loop.submit(SetStrain(0.0))) is None


def test_the_second_of_two_simultaneous_requests_is_refused_as_busy(start):
    loop = start(rig.device(1))
    hold(loop)
    first, second = loop.submit(Write(2)), loop.submit(Read())
    loop.pause(False)
    assert 'busy: write is running' in refusal(second)
    assert result(first).reading.level == 2


def test_every_request_gets_its_own_answer(start):
    """An abort ends a write, and another abort the first: three answers at once."""
    loop = start(rig.device(1))
    hold(loop)
    answers = [loop.submit(command) for command in (Write(3), Abort(), Abort())]
    loop.pause(False)
    outcomes = [result(answer) for answer in answers]
    told = [(outcome.procedure, outcome.error) for outcome in outcomes]
    assert told == [('write', 'aborted'), ('abort', 'aborted'), ('abort', '')]


def test_a_cancel_ends_the_procedure_of_its_own_command_in_the_next_tick(start):
    stamped = []
    loop = start(rig.device(1), lambda commands, _: stamped.extend(commands), speed=1.0)
    hold(loop)
    mine = loop.submit(Write(3))
    for _ in range(80):  # it has read what is there, and strains
        result(loop.step().answer)
    canceled = loop.cancel(mine)
    began = result(loop.step().answer)
    assert result(mine).error == 'aborted: canceled by its client'
    assert loop.element.procedure == 'abort'
    loop.pause(False)
    loop.set_speed(0.0)
    assert result(canceled).procedure == 'abort'
    assert loop.element.actuator.strain == 0.0
    assert stamped[1:] == [(began - 1, Abort('canceled by its client'))]  # as any abort is told


def test_a_cancel_does_not_end_another_clients_procedure(start):
    loop = start(rig.device(1))
    hold(loop)
    mine, equal = loop.submit(Read()), loop.submit(Read())
    result(loop.step().answer)
    assert 'busy' in refusal(equal)
    late = loop.cancel(equal)
    loop.pause(False)
    assert result(late) is None
    assert result(mine).success
    assert result(loop.cancel(mine)) is None  # it has ended


def test_a_withdrawn_request_is_not_executed(start):
    stamped = []
    loop = start(rig.device(), lambda commands, _: stamped.extend(commands))
    hold(loop)
    withdrawn, kept = loop.submit(Write(1)), loop.submit(SetStrain(0.0))
    step = loop.step().answer
    assert withdrawn.answer.cancel()
    result(step)
    assert result(kept) is None
    assert [command for _, command in stamped] == [SetStrain(0.0)]
    assert loop.failure is None


def test_a_request_in_progress_cannot_be_withdrawn(start):
    loop = start(rig.device())
    hold(loop)
    answer = loop.submit(Read())
    result(loop.step().answer)
    assert not answer.answer.cancel()
    loop.pause(False)
    assert result(answer).success


def test_a_function_is_called_between_ticks_in_the_loops_thread(start):
    loop = start(rig.device())
    here = threading.get_ident()
    assert result(loop.call(threading.get_ident)) != here
    taken = result(loop.call(lambda: snapshot.take(loop.element)))
    snapshot.restore(rig.device(), taken)
    with pytest.raises(ZeroDivisionError):
        result(loop.call(lambda: 1 / 0))
    assert loop.failure is None, 'it is the failure of who called'
    ticks = hold(loop)
    assert result(loop.call(lambda: loop.element.ticks)) == ticks, 'paused, too'


# --- the end ----------------------------------------------------------------------------------


def test_a_material_that_fails_stops_the_loop_with_the_reason(start):
    loop = start(rig.device(2))
    waiting = loop.submit(Write(3))
    until(lambda: loop.element.procedure)
    hold(loop)
    also, step = loop.submit(SetStrain(0.0)), loop.step().answer
    result(step)
    later = loop.submit(Read())
    assert 'busy' in refusal(also)
    result(loop.call(lambda: loop.element.chain.v.__setitem__(100, math.nan)))
    doomed = loop.step().answer
    for answer in (waiting, doomed):
        assert refusal(answer).startswith('the device has stopped: the chain stopped being finite')
    assert 'busy' in refusal(later)  # it was put in the tick that failed
    assert isinstance(loop.failure, StateError)
    for answer in (loop.submit(Read()), loop.call(int), loop.step().answer):
        assert refusal(answer).startswith('the device has stopped: the chain')
    ticks = loop.element.ticks
    time.sleep(0.02)
    assert loop.element.ticks == ticks
    loop.stop()
    assert refusal(loop.submit(Read())).startswith('the device has stopped: the chain')


@pytest.mark.parametrize('kind', [RuntimeError, SystemExit, KeyboardInterrupt])
def test_a_listener_that_fails_stops_the_loop(start, kind):
    """Whatever it raises: a thread that ends in silence would leave its clients waiting."""

    def listen(commands, events):
        if commands:
            raise kind('no room left')

    loop = start(rig.device(), listen)
    answer = loop.submit(Erase())
    assert refusal(answer) == 'the device has stopped: no room left'
    assert str(loop.failure) == 'no room left'


@pytest.mark.parametrize('batch', [1, 10])
def test_a_resting_loop_without_a_pace_takes_commands(start, batch):
    """Nothing is late without a pace: when a command ends a rest, no ticks are made up for."""
    loop = start(rig.device(), speed=0.0, batch=batch)
    for strain in (0.001, 0.0):
        until(lambda: loop.element.still and loop.element.ticks > 100)
        assert result(loop.submit(SetStrain(strain))) is None
    loop.set_speed(1e6)
    assert result(loop.submit(Read())).reading is not None
    loop.set_speed(0.0)
    assert result(loop.submit(Read())).reading is not None


def test_a_loop_finished_while_single_ticks_wait_releases_the_strain(start):
    for _ in range(8):
        loop = start(rig.device())
        result(loop.submit(SetStrain(0.01)))
        hold(loop)
        steps = [loop.step().answer for _ in range(50)]
        loop.finish()
        assert loop.failure is None
        assert loop.element.released
        assert loop.element.actuator.strain == 0.0
        assert all(step.done() for step in steps)


@pytest.mark.parametrize('of', ['now', 'wait'])
def test_a_clock_that_fails_stops_the_loop(start, of):
    """A ROS clock does when its context has been shut down."""

    def fail(*_):
        raise RuntimeError('the clock has gone')

    clock = Clock()
    loop = start(rig.device(), pacer=clock, speed=1.0)
    answer = loop.submit(Calibrate())
    setattr(clock, of, fail)
    assert refusal(answer) == 'the device has stopped: the clock has gone'
    assert refusal(loop.submit(Read())) == 'the device has stopped: the clock has gone'


@pytest.mark.parametrize('started', [True, False])
def test_pending_requests_are_refused_when_the_loop_stops(started):
    loop = Loop(rig.device(2), lambda *_: None, speed=0.0)
    loop.pause(True)
    running = None
    if started:
        loop.start()
        running = loop.submit(Calibrate()).answer
        result(loop.step().answer)
    waiting = [loop.submit(each).answer for each in (Write(1), SetStrain(0.0), Abort())]
    called = None if started else loop.call(int)
    loop.stop()
    for answer in filter(None, (running, called, *waiting)):
        assert answer.done()
        assert refusal(answer) == 'the device is shut down'
    assert refusal(loop.submit(Read())) == 'the device is shut down'
    assert refusal(loop.step().answer) == 'the device is shut down'
    loop.stop()  # once more does no harm


def test_every_request_is_answered_when_the_loop_stops(start):
    """Sixteen threads send requests while the loop stops; each gets an answer."""
    for _ in range(3):
        loop = start(rig.device())
        answers, ready = [], threading.Barrier(17)

        def ask(loop=loop, answers=answers, ready=ready):
            ready.wait()
            for n in range(40):
                answers.append(loop.submit(SetStrain(0.0) if n % 4 else Read()).answer)

        threads = [threading.Thread(target=ask) for _ in range(16)]
        for thread in threads:
            thread.start()
        ready.wait()
        loop.stop()
        for thread in threads:
            thread.join()
        done, not_done = wait(answers, timeout=PATIENCE)
        assert not not_done
        assert len(done) == 16 * 40
        assert loop.failure is None


def test_a_loop_with_rare_ticks_stops_at_once(start):
    element = rig.device(scale=ScaleSettings(time=10.0))  # a tick in 200 s
    loop = start(element, speed=1.0)
    until(lambda: element.ticks == 1)
    begun = time.monotonic()
    loop.stop()
    assert time.monotonic() - begun < 5.0


def test_finishing_brings_the_strain_to_zero_without_waiting_for_the_clock(start):
    element = rig.device(2)
    clock = Clock(end=0.0)  # stands still until the write is in the inbox
    loop = start(element, pacer=clock, speed=1.0)
    writing = loop.submit(Write(3))
    clock.end = 0.3  # and again in the middle of the write, in tick 150
    until(lambda: clock.time >= 0.3)
    assert not writing.answer.done()
    assert abs(element.actuator.strain) > 0.01
    loop.finish()
    assert result(writing).error == 'aborted: the device is shut down'
    assert element.actuator.strain == 0.0
    assert element.procedure == ''
    assert refusal(loop.submit(Read())) == 'the device is shut down'


def test_finishing_a_paused_or_failed_loop_ends_too(start):
    paused = start(rig.device(2))
    paused.submit(SetStrain(0.02))
    until(lambda: paused.element.actuator.strain > 0.0)
    hold(paused)
    paused.finish()
    assert paused.element.actuator.strain == 0.0
    failed = start(rig.device(2))
    result(failed.call(lambda: failed.element.chain.v.__setitem__(3, math.nan)))
    until(lambda: failed.failure is not None)
    failed.finish()


def test_too_many_pending_commands_are_refused(start):
    loop = start(rig.device())
    hold(loop)
    answers = [loop.submit(SetStrain(0.0)) for _ in range(MOST + 5)]
    for late in answers[MOST:]:
        assert refusal(late) == '1000 requests are already waiting'
    loop.pause(False)
    assert all(result(answer) is None for answer in answers[:MOST])


def test_a_newer_acceleration_replaces_a_pending_one(start):
    """An IMU goes on while time is paused: only its newest message is kept."""
    stamped = []
    loop = start(rig.device(), lambda commands, events: stamped.extend(commands))
    loop.pause(True).result(PATIENCE)
    asked = [SetStrain(0.01), *(Disturb(1e-6 * n) for n in range(1000))]
    answers = [loop.submit(command) for command in asked]
    with pytest.raises(Refused, match='acceleration must be'):
        loop.submit(Disturb(math.nan)).answer.result(0.0)
    assert all(request.answer.result(0.0) is None for request in answers[1:-1])
    loop.step().answer.result(PATIENCE)
    assert [command for _, command in stamped] == [asked[0], asked[-1]]
