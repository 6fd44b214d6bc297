# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Commands that a loop is handed, its answers, pauses and its end; and its pace: when ticks run.

The clock is virtual: no bit depends on the real one. `test_runs` holds the property that any cut
of time gives the same bits, on time.
"""

import itertools
import math
import threading
import time
from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest
import rig
from loops import PATIENCE, PERIOD, Clock, hold, refusal, result, until
from suite import expect_rejection

from mlmem import (
    Abort,
    Disturb,
    EchoReceived,
    Loop,
    Outcome,
    Read,
    Refused,
    SetStrain,
    SettingsError,
    Write,
)
from mlmem.loop.mailbox import MAX_PENDING_REQUESTS, Cancel, Mailbox, OpenRequests, Request
from mlmem.loop.timetable import LoopStatistics, SteadyPacer, Timetable
from mlmem.settings import Settings

pytestmark = pytest.mark.timeout(60)


@pytest.mark.parametrize('kind', [RuntimeError, SystemExit, KeyboardInterrupt])
@pytest.mark.parametrize('part', ['apply', 'listener', 'now', 'wait'])
def test_loop_stops_when_a_part_of_it_fails(start, part, kind):
    """A command, a listener, or a ROS clock whose context is gone. Whatever it raises: a thread
    that ends in silence would leave its clients waiting.
    """
    element, clock, fault = rig.device(), Clock(), kind('it has gone')
    fail = Mock(side_effect=fault)

    def listen(commands, events):
        if commands and part == 'listener':
            fail()

    loop = start(element, listen, pacer=clock, speed=1.0)
    if part != 'listener':
        setattr(element if part == 'apply' else clock, part, fail)
    if part == 'apply':
        assert loop.submit(Read()).answer.exception(PATIENCE) is fault
        until(lambda: loop.failure is fault)
    for _ in range(2):
        assert refusal(loop.submit(Read())) == 'the device has stopped: it has gone'
    assert loop.failure is fault


def test_procedure_is_answered_after_its_outcome_was_published(start):
    """Or a client would still find the old level on ~/level."""
    events, answered = [], []

    def publish(commands, told):
        events.extend(told)
        answered.extend(request.answer.done() for event in told if isinstance(event, Outcome))

    loop = start(rig.device(1), publish)
    hold(loop)
    request, second = loop.submit(Write(2)), loop.submit(Read())
    loop.pause(False)
    assert second.answer.exception(PATIENCE).code.value == 'busy'
    assert not second.answer.cancel()
    outcome = result(request)
    assert (outcome.success, outcome.reading.level) == (True, 2)
    loop.shut_down()
    assert answered == [False]
    assert [type(event) for event in events] == 4 * [EchoReceived] + [Outcome]
    assert rig.true_level(loop.element) == 2


def test_cancel_ends_procedure_of_its_own_command_in_next_tick(start):
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


def test_cancel_does_not_end_another_clients_procedure(start):
    loop = start(rig.device(1))
    hold(loop)
    mine, equal = loop.submit(Read()), loop.submit(Read())
    result(loop.step().answer)
    assert equal.answer.exception(PATIENCE).code.value == 'busy'
    late = loop.cancel(equal)
    loop.pause(False)
    assert result(late) is None
    assert result(mine).success
    assert loop.cancel(None).answer.exception(PATIENCE).code == 'out_of_range'
    assert result(loop.cancel(mine)) is None  # it has ended


@pytest.mark.parametrize('started', [True, False])
def test_pending_requests_are_rejected_when_loop_stops(started):
    loop = Loop(rig.device(2), lambda *_: None, speed=0.0)
    loop.pause(True)
    running = None
    if started:
        loop.start()
        running = loop.submit(Write(0)).answer
        result(loop.step().answer)
    waiting = [loop.submit(each).answer for each in (Write(1), SetStrain(0.0), Abort())]
    called = None if started else loop.call(int)
    loop.shut_down()
    if running:
        assert result(running).code == 'aborted'
    for answer in filter(None, (called, *waiting)):
        assert answer.done()
        assert refusal(answer) == 'the device is shut down'
        assert answer.exception().code == 'inactive'
    assert refusal(loop.submit(Read())) == 'the device is shut down'
    assert refusal(loop.step().answer) == 'the device is shut down'
    loop.shut_down()  # once more does no harm


def test_finish_releases_strain_without_waiting_for_clock(start):
    element = rig.device(2)
    clock = Clock(end=0.0)  # stands still until the write is in the inbox
    loop = start(element, pacer=clock, speed=1.0)
    writing = loop.submit(Write(3))
    clock.end = 0.3  # and again in the middle of the write, in tick 150
    until(lambda: clock.time >= 0.3)
    assert not writing.answer.done()
    assert abs(element.actuator.strain) > 0.01
    loop.shut_down()
    assert result(writing).code == 'aborted'
    assert element.actuator.strain == 0.0
    assert element.procedure == ''
    assert refusal(loop.submit(Read())) == 'the device is shut down'


def test_too_many_pending_commands_are_rejected(start):
    loop = start(rig.device())
    hold(loop)
    answers = [loop.submit(SetStrain(0.0)) for _ in range(MAX_PENDING_REQUESTS + 5)]
    for late in answers[MAX_PENDING_REQUESTS:]:
        assert late.answer.exception(PATIENCE).code.value == 'busy'
    loop.pause(False)
    assert all(result(answer) is None for answer in answers[:MAX_PENDING_REQUESTS])


def test_withdrawn_or_replaced_request_is_not_executed(start):
    """An IMU goes on while time is paused: only its newest message is kept."""
    stamped = []
    loop = start(rig.device(), lambda commands, events: stamped.extend(commands))
    hold(loop)
    assert loop.submit(Write(1)).answer.cancel()
    asked = [SetStrain(0.01), *(Disturb(1e-6 * n) for n in range(1000))]
    answers = [loop.submit(command) for command in asked]
    with expect_rejection(Refused, 'out_of_range', 'acceleration'):
        loop.submit(Disturb(math.nan)).answer.result(0.0)
    assert all(request.answer.result(0.0) is None for request in answers[1:-1])
    assert len(loop._box.shakes) == 1
    result(loop.step())
    assert result(answers[0]) is None
    assert [command for _, command in stamped] == [asked[0], asked[-1]]
    assert loop.failure is None


def test_pause_is_not_overrun(start):
    clock = Clock()
    loop = start(rig.device(), lambda *_: time.sleep(1e-4), pacer=clock, speed=1.0)
    until(lambda: loop.element.ticks > 3)
    hold(loop)
    clock.time += 100.0
    loop.pause(False)
    ticks = loop.element.ticks
    until(lambda: loop.element.ticks > ticks + 3)
    assert loop.statistics.overruns == 0


def test_steps_are_exact_numbers_of_ticks(start):
    loop = start(rig.device())
    assert loop.step().answer.exception(PATIENCE).code.value == 'conflict'  # it runs
    ticks = hold(loop)
    for n in range(1, 6):
        assert result(loop.step().answer) == ticks + n
    many = [loop.step().answer for _ in range(10)]
    assert [result(tick) for tick in many] == [ticks + 6 + n for n in range(10)]
    assert result(loop.step(7)) == ticks + 22
    for wrong in (0, -1, 1.0, None):
        assert loop.step(wrong).answer.exception(PATIENCE).code == 'out_of_range'
    time.sleep(0.02)
    assert loop.element.ticks == ticks + 22
    stepping = loop.step(10**6)
    until(lambda: loop.element.ticks > ticks + 22)
    loop.pause(True)  # which ends ticks that were asked for
    assert result(stepping) == ticks + 22 + stepping.asked.done < ticks + 10**6


def test_single_tick_is_answered_even_if_pause_ends_first(start):
    loop = start(rig.device())
    hold(loop)
    blocked = threading.Event()
    holding = loop.call(blocked.wait)  # the loop's thread is busy until we let it
    tick = loop.step().answer
    loop.pause(False)
    blocked.set()
    result(holding)
    assert result(tick) > 0


@pytest.mark.parametrize('leaves', ['canceled', 'past its deadline'])
def test_places_move_up_when_a_request_leaves(leaves):
    requests = OpenRequests(rig.device(), None, None, most=3)
    running, *waiting = (Request(Write(1), waits=True) for _ in range(4))
    for request in (running, *waiting):
        requests.apply(request)
    assert [request.place for request in (running, *waiting)] == [0, 1, 2, 3]
    first = waiting[0]
    if leaves == 'canceled':
        requests.apply(Request(Cancel(first)))
    else:
        first.deadline = 0.0
        requests.refuse_expired()
    codes = {'canceled': 'other', 'past its deadline': 'busy'}
    assert first.answer.exception(0.0).code == codes[leaves]
    assert [request.place for request in waiting] == [0, 1, 2]


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
