# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reads of an element whose base shakes: right or undecodable, never wrong.

At the default scale 1 g is 9.81e-6 lattice constants per time unit squared, and an IMU of 200 Hz
sends a message every 2.5 ticks.
"""

import numpy as np
import pytest

from mlmem_ros.device import UNDECODABLE, Disturb, Read, Write
from mlmem_ros.device.carrier import carried, half_period
from mlmem_ros.device.echo import EchoDetector
from mlmem_ros.device.end import End
from mlmem_ros.device.events import Heard
from mlmem_ros.device.settings import ProbeSettings

from . import rig

G = 9.81e-6
PROBES = {End.LEFT: ProbeSettings(), End.RIGHT: ProbeSettings(omega_c=0.7, sigma=5.0, v_th=7e-4)}
DT = 0.25


# --- the carrier apart from the sway ----------------------------------------------------------


@pytest.mark.parametrize('end', list(End))
def test_the_carrier_passes_in_phase(end):
    probe = PROBES[end]
    lag = half_period(probe, DT)
    t = np.arange(2000) * DT
    wave = np.sin(probe.omega_c * t)
    passed = carried(wave, lag)
    np.testing.assert_allclose(passed, wave[2 * lag : -2 * lag], atol=1e-3)


@pytest.mark.parametrize('end', list(End))
def test_a_sway_ten_times_slower_does_not_pass(end):
    """sin^4(pi / 20) is 6e-4."""
    probe = PROBES[end]
    t = np.arange(2000) * DT
    passed = carried(1.0 + np.sin(0.1 * probe.omega_c * t), half_period(probe, DT))
    assert np.abs(passed).max() == pytest.approx(6e-4, rel=0.1)


def test_too_few_samples_give_nothing():
    for n in (0, 3, 24):
        assert carried(np.ones(n), 6).shape == (0,)
    assert carried(np.ones(25), 6).shape == (1,)


def test_a_detector_hears_the_same_by_ticks_as_at_once():
    v = np.random.default_rng(1).normal(0.0, 1e-4, 4000)
    at_once, by_ticks = (EchoDetector(PROBES[End.LEFT], DT, shaken=True) for _ in range(2))
    at_once.feed(v)
    for some in np.split(v, [7, 20, 100, 1000]):
        by_ticks.feed(some)
    first, second = at_once.echo(End.LEFT), by_ticks.echo(End.LEFT)
    assert first.shaken
    assert len(first.t) > 3900
    assert first.delay == second.delay
    np.testing.assert_allclose(second.v_m, first.v_m, rtol=0.0, atol=1e-19)
    np.testing.assert_allclose(second.v_c, first.v_c, rtol=0.0, atol=1e-15)


# --- reads ------------------------------------------------------------------------------------


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


@pytest.mark.parametrize(('end', 'reads'), [('left', 12), ('right', 4), ('both', 2)])
def test_every_read_is_right_at_an_amplitude_that_used_to_spoil_a_quarter(end, reads):
    """The sway of the left end exceeds the decayed threshold when the echo of level 7 arrives.

    Two pulses from an end suffice: each waits until the previous one has faded.
    """
    element, course = rig.device(7), imu(1.5 * G, 3)
    for _ in range(reads):
        *heard, outcome = shaken(element, course, Read(end))
        assert outcome.success, outcome.error
        assert outcome.reading.level == 7
        assert len(heard) == (4 if end == 'both' else 2)
    assert rig.holds(element, 7)


def test_shaking_leaves_no_trace_in_later_reads():
    """One pulse without a filter, in as many ticks as before."""
    calm, once = rig.device(3), rig.device(3)
    once.apply(Disturb(1e-5))
    rig.ticks(once, 60)  # held for the time-out, and then not
    rig.ticks(once, 400)
    assert once.base.still
    for element in (calm, once):
        heard, outcome = rig.events(element, Read())
        assert isinstance(heard, Heard)
        assert not heard.echo.shaken
        assert heard.echo.delay == 460.5
        assert outcome.end_tick - outcome.start_tick == 32


def test_an_echo_hidden_by_shaking_is_reported_after_some_pulses():
    """At 10 g and 247 Hz the right end hums: sampled once a tick, it has an image at 469 mrad per
    time unit.
    """
    element = rig.device(0)
    events = shaken(element, sine(10.0 * G, 0.155), Read('right'))
    outcome = events[-1]
    assert not outcome.success
    assert 'the shaking at the right end hides when the echo began' in outcome.error
    assert sum(isinstance(event, Heard) for event in events) == 4  # read.attempts
    assert element.reading.level == UNDECODABLE


def test_a_reading_counts_only_when_a_second_pulse_agrees():
    element = rig.device(5)
    events = shaken(element, imu(G, 1), Read())
    first, second = [event.reading for event in events if isinstance(event, Heard)]
    assert first.level == UNDECODABLE
    assert first.reason == 'while the base shakes two pulses must agree: level 5'
    assert second.level == 5


def test_a_base_that_begins_to_shake_spoils_the_echo():
    element = rig.device(7)
    element.apply(Read())
    events, course = [], imu(3.0 * G, 2)
    while element.procedure:
        detector = element.transducer.detector
        if (detector and detector.time > 500.0) or not element.base.still:
            element.apply(Disturb(next(course)))
        events += element.advance()
    said = [event.reading for event in events if isinstance(event, Heard)]
    assert said[0].reason == 'the base began to shake while the left end listened'
    assert [reading.level for reading in said] == [UNDECODABLE, UNDECODABLE, 7]
    assert events[-1].success


def test_the_ends_agree_while_they_shake():
    outcome = shaken(rig.device(4), imu(2.0 * G, 5), Read('both'))[-1]
    assert outcome.success, outcome.error
    assert (outcome.reading.level, outcome.reading.walls) == (4, 1)


def test_a_write_is_verified_while_the_base_shakes(written):
    element = written(5)
    outcome = shaken(element, imu(1.5 * G, 4), Write(7))[-1]
    assert outcome.success, outcome.error
    assert outcome.reading.level == 7
    assert rig.holds(element, 7)
