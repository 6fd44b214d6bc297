# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A paused loop, and single ticks."""

import threading
import time

import pytest

from mlmem import Inject, SetStrain

from . import rig
from .loops import PATIENCE, PERIOD, Clock, hold, refusal, result, until

pytestmark = pytest.mark.timeout(60)


def test_a_paused_device_does_not_move(start):
    loop = start(rig.device(2), speed=0.1)
    loop.submit(SetStrain(0.08))  # the longest way: 1.2 s, for machines that are busy, too
    until(lambda: loop.element.ticks > 3)
    assert not loop.paused
    ticks = hold(loop)
    assert loop.paused
    before = rig.bits(loop.element)
    assert loop.element.actuator.is_moving
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
    assert not loop.element.faults.list_active()
    result(loop.step().answer)
    assert loop.element.faults.list_active() == {'actuator_stuck': True}


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
    assert loop.element.actuator.is_moving


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
