# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The pace of a loop: when ticks run, on a virtual clock; no bit depends on the real one."""

import itertools
import math
import time

import pytest

from mlmem import Abort, Loop, Read, SetStrain, SettingsError, Write
from mlmem.settings import ScaleSettings

from . import rig
from .loops import PERIOD, Clock, result, until

pytestmark = pytest.mark.timeout(60)


def test_ticks_come_at_period(start):
    clock, begun = Clock(end=0.201), []
    loop = start(rig.device(), lambda *_: begun.append(clock.time), pacer=clock, speed=1.0)
    until(lambda: len(begun) == 101)
    loop.stop()
    assert begun == pytest.approx([n * PERIOD for n in range(101)], abs=1e-12)
    assert loop.statistics.ticks == loop.element.ticks == 101
    assert loop.statistics.overruns == 0
    assert loop.statistics.lateness_mean == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize('speed', [1e-320, 9e-4, -1.0, math.nan, math.inf, 1e7])
def test_speed_at_which_no_tick_would_end_is_rejected(start, speed):
    """A request waits for the end of a tick, and with it an abort."""
    loop = start(rig.device(), speed=1.0)
    with pytest.raises(SettingsError, match=r'must be 0 .* or from 0\.001 to 1e\+06'):
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


def test_steps_of_coarse_clock_are_caught_up(start):
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
def test_clock_that_jumps_neither_stops_nor_hurries_loop(start, jump):
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


@pytest.mark.parametrize(('speed', 'batch'), [(0.0, 1), (40.0, 1), (40.0, 20)])
def test_loop_computes_bits_of_stamped_commands_by_hand(start, speed, batch):
    """The clock decides in which ticks commands take effect; the stamps record them."""
    stamped, heard, aborted = [], [], []

    def listen(commands, events):
        stamped.extend(commands)
        heard.extend(map(rig.plain, events))
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
        again += map(rig.plain, by_hand.advance())
    assert again == heard
    assert rig.bits(by_hand) == rig.bits(loop.element)
