# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A paused loop, and single ticks."""

import threading
import time

import pytest

from mlmem import Inject, SetStrain

from . import rig
from .loops import PATIENCE, Clock, hold, result, until

pytestmark = pytest.mark.timeout(60)


def test_paused_device_does_not_move(start):
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


def test_script_injected_during_pause_begins_with_next_tick(start):
    loop, script = start(rig.device()), '[{"unit": "actuator", "failure": "stuck"}]'
    hold(loop)
    assert result(loop.submit(Inject(script))) is None
    assert not loop.element.faults.list_active()
    result(loop.step().answer)
    assert loop.element.faults.list_active() == {'actuator_stuck': True}


def test_pause_counts_tick_in_progress(start):
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


def test_single_ticks_are_single(start):
    loop = start(rig.device())
    ticks = hold(loop)
    for n in range(1, 6):
        assert result(loop.step().answer) == ticks + n
    many = [loop.step().answer for _ in range(10)]
    assert [result(tick) for tick in many] == [ticks + 6 + n for n in range(10)]
    time.sleep(0.02)
    assert loop.element.ticks == ticks + 15


def test_command_waits_for_single_tick(start):
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
