# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reads of an element whose base shakes: right or undecodable, never wrong.

At the default scale 1 g is 9.81e-6 lattice constants per time unit squared, and an IMU of 200 Hz
sends a message every 2.5 ticks.
"""

import numpy as np
import pytest
from sampled import sampled

from mlmem import UNDECODABLE, Disturb, Outcome, Read, Write
from mlmem.commands import EchoReceived
from mlmem.instrument.end import End

from . import rig

G = 9.81e-6


def imu(amplitude, seed):
    """Yield the acceleration of white noise within an amplitude, tick by tick."""
    random, share = np.random.default_rng(seed), 0.0
    while True:
        a = amplitude * random.uniform(-1.0, 1.0)
        ticks = int(share + 2.5)
        share += 2.5 - ticks
        yield from [float(a)] * ticks


def sine(amplitude, omega):
    """Yield a harmonic acceleration, tick by tick."""
    tick = 0
    while True:
        tick += 1
        yield float(amplitude * np.sin(omega * 20.0 * tick))


def shaken(element, course, command):
    """Shake a device during a command; return all events."""
    element.apply(command)
    seen = []
    while element.procedure:
        element.apply(Disturb(next(course)))
        seen += element.advance()
    return seen


@pytest.mark.parametrize(('end', 'reads'), [('left', 4), ('right', 1), ('both', 1)])
def test_read_of_far_level_is_right_at_15_m_per_s2(end, reads):
    """The sway of the left end exceeds the decayed threshold when the echo of level 7 arrives."""
    element, course = rig.paper(7), imu(1.5 * G, 3)
    for _ in range(reads):
        *heard, outcome = shaken(element, course, Read(end))
        assert outcome.success, outcome.error
        assert outcome.reading.level == 7
        assert len(heard) == 2, 'one pulse from either end suffices: they confirm each other'
    assert rig.holds(element, 7)


def test_echo_hidden_by_shaking_is_reported_after_4_pulses():
    """At 30 g and 247 Hz the right end hums: sampled once a tick, it has an image at 469 mrad per
    time unit, of which the carrier filter passes an eighth.
    """
    element = rig.device(3)
    events = shaken(element, sine(30.0 * G, 0.155), Read('right'))
    outcome, lost = events[-2:]
    assert lost.reason == 'shaken'
    assert not outcome.success
    assert 'the shaking at the right end hides when the echo began' in outcome.error
    assert sum(isinstance(event, EchoReceived) for event in events) == 2 * 4  # read.attempts
    assert outcome.reading.level == UNDECODABLE


def test_base_that_begins_to_shake_spoils_echo():
    """Whose contribution is not known; the next pulses are fired when it is."""
    element = rig.paper(7)
    element.apply(Read())
    events, course = [], imu(3.0 * G, 2)
    while element.procedure:
        left = element.transducer.detectors.get(End.LEFT)
        if (left and left.time > 500.0) or not element.base.still:
            element.apply(Disturb(next(course)))
        events += element.advance()
    said = [event.reading for event in events if isinstance(event, EchoReceived)]
    assert said[0].reason == 'the base began to shake while the left end listened'
    assert [reading.level for reading in said] == [UNDECODABLE, UNDECODABLE, 7, 7]
    assert events[-1].success


@pytest.mark.parametrize('moment', sampled(range(1, 25, 2), lambda moment: moment % 4 == 1))
def test_base_that_begins_to_shake_gives_no_wrong_level(moment):
    """At any tick of a read, which takes some 25: at 20 g for a while, then not at all."""
    element, course = rig.device(3), imu(20.0 * G, moment)
    element.apply(Read())
    events = rig.ticks(element, moment)
    for _ in range(20):
        element.apply(Disturb(next(course)))
        events += element.advance()
    events += rig.ticks(element, 400)
    outcome = next(event for event in events if isinstance(event, Outcome))
    assert outcome.success, outcome.error
    assert outcome.reading.level == 3


def test_write_is_verified_while_base_shakes(written):
    element = written(2)
    outcome = shaken(element, imu(1.5 * G, 4), Write(3))[-1]
    assert outcome.success, outcome.error
    assert outcome.reading.level == 3
    assert rig.holds(element, 3)


def strides(amplitude, period, seed):
    """Yield the acceleration of a walking body, four harmonics of its stride, tick by tick."""
    random = np.random.default_rng(seed)
    phases, shares = random.uniform(0.0, 2.0 * np.pi, 4), random.uniform(0.3, 1.0, 4)
    angle = 2.0 * np.pi * 20.0 / period * np.arange(1, 5)
    tick = 0
    while True:
        tick += 1
        yield float(0.5 * amplitude * (shares * np.sin(angle * tick + phases)).sum())


@pytest.mark.parametrize(('level', 'seed'), [(0, 16), (5, 37)])
def test_wall_that_is_shaken_about_is_at_no_level(level, seed):
    """Ten times what is harmless moves it while pulses are under way: both ends agreed on level 3
    and the wall was near level 4, on 6 and it was half-way to 5.
    """
    *_, outcome = (
        event
        for event in shaken(rig.paper(level), strides(1.5e-3, 250.0, seed), Read())
        if isinstance(event, Outcome)
    )
    assert not outcome.success
    assert outcome.reading.level == UNDECODABLE
