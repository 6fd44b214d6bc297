# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ticks that a loop defers while nothing is decided, and runs together; and its sleep beside an
element at rest.
"""

import itertools
import time

import pytest

from mlmem import Disturb, Faults, SetStrain, Write, snapshot
from mlmem.loop.timetable import WAKE_UP_TIME_S, SteadyPacer

from . import rig
from .loops import PATIENCE, PERIOD, Clock, restless, result, until

pytestmark = pytest.mark.timeout(60)


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
    clock.jump(0.0151)
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
    assert snapshot.take_snapshot(element) == snapshot.take_snapshot(other)


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
        assert snapshot.take_snapshot(rested) == snapshot.take_snapshot(other)
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
    clock.jump(10.0381)
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
    assert snapshot.take_snapshot(element) == snapshot.take_snapshot(other)
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
        clock.jump(now)
        loop.submit(Disturb(1e-6 * size))
    clock.end = 0.0181
    until(lambda: loop.element.ticks == 10)
    assert stamped == [(tick, Disturb(1e-6 * size)) for tick, size in ((1, 1), (2, 3), (5, 4))]
    assert begun == pytest.approx([0.016, 0.018], abs=1e-12)


def test_deferred_ticks_are_done_just_as_the_next_is_due(start):
    """A tick takes 0.1 ms: a run of nine begins 0.9 ms and what waking takes before the tenth, and
    does not delay it.

    Before it is known how long they take, a run begins a period before that tick.
    """
    clock, begun, element = Clock(end=0.06), [], restless()

    def listen(*_):
        begun.append(clock.time)
        clock.time += 1e-4 * (9 if element.ticks % 10 == 9 else 1)

    loop = start(element, listen, pacer=clock, speed=1.0, batch=10, stream_period=lambda: 10)
    until(lambda: element.ticks == 30)
    loop.stop()
    expected = [0.016, 0.018, 0.0371 - WAKE_UP_TIME_S, 0.038, 0.0571 - WAKE_UP_TIME_S, 0.058]
    assert begun == pytest.approx(expected, abs=1e-12)
