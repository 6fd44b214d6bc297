# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The sleep of a loop next to an element at rest.

`test_deferral` holds the property: any cut of time gives the same bits, on time.
"""

import itertools
import time

import pytest

from mlmem import Disturb, SetStrain
from mlmem.loop.timetable import SteadyPacer

from . import rig
from .loops import PATIENCE, PERIOD, Clock, result, until

pytestmark = pytest.mark.timeout(60)


def asleep(ticks=40):
    """Return a device at rest, which knows it from a tick that it has computed."""
    element = rig.device()
    rig.ticks(element, ticks)
    assert element.at_rest
    return element


def test_device_at_rest_sleeps_while_nobody_watches(start):
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
def test_speed_change_finds_resting_device_in_its_present_tick(start, speed):
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


class Sleeper(SteadyPacer):
    """A clock on which who is not woken sleeps on."""

    def wait(self, changed, seconds):
        changed.wait(10.0 * PATIENCE)


def test_acceleration_that_arrives_at_rest_wakes_loop(start):
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


def test_resting_device_runs_thousand_ticks_without_pace(start):
    element, told = asleep(), []
    loop = start(element, lambda *_: told.append(element.ticks), speed=0.0,
                 stream_period=lambda: 0)  # fmt: skip
    until(lambda: len(told) >= 5)
    loop.stop()
    assert {b - a for a, b in itertools.pairwise(told)} == {1000}
