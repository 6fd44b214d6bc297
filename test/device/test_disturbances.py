# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A base that shakes, and reads with a noisy sensor or a shaken base.

At the default scale 1 g is 9.81e-6 lattice constants per time unit squared, and an IMU of 200 Hz
sends a message every 2.5 ticks.
"""

import dataclasses
import itertools
import math

import numpy as np
import pytest
import rig
from suite import expect_rejection, sampled

from mlmem import BLANK, UNDECODABLE, Disturb, Outcome, Read, Refused, SelfTest
from mlmem.instrument.base import Base, BaseState
from mlmem.physics import CASE_II
from mlmem.settings import DisturbanceSettings, ScaleSettings

TICK = 20.0
PROGRESS = np.array([0.25, 0.5, 0.75, 1.0])


def test_acceleration_ramps_linearly_to_message_and_holds():
    """A dead sensor stops shaking: a time-out of 60 is three ticks, and a fourth ends at rest."""
    base = Base(DisturbanceSettings(timeout=60.0), TICK)
    assert base.advance(PROGRESS) is None
    assert not base.find_harmful_tick()
    base.accept_acceleration(4e-3)
    np.testing.assert_allclose(base.advance(PROGRESS), [1e-3, 2e-3, 3e-3, 4e-3], rtol=1e-15)
    np.testing.assert_array_equal(base.advance(PROGRESS), [4e-3] * 4)
    base.accept_acceleration(-4e-3)
    np.testing.assert_allclose(base.advance(PROGRESS), [2e-3, 0.0, -2e-3, -4e-3], atol=1e-18)
    ends = []
    while (course := base.advance(PROGRESS)) is not None:
        ends.append(course[-1])
    assert ends == [-4e-3, -4e-3, 0.0]
    assert base.state == BaseState()  # as if it had never moved
    base.accept_acceleration(1e-3)  # and again
    assert base.advance(PROGRESS)[-1] == 1e-3


def test_acceleration_that_makes_all_cells_slide_is_rejected():
    """However much is to be taken: beyond the force that holds the cells nothing stops them."""
    design = dataclasses.replace(CASE_II, d=0.002)
    element = rig.device(design=design, calibration=rig.device(design=CASE_II).calibration)
    hold = design.holding_force
    assert hold == pytest.approx(CASE_II.holding_force * 0.002 / 0.038)
    assert hold < element.settings.disturbance.max_acceleration < CASE_II.holding_force
    with expect_rejection(Refused, 'out_of_range', 'acceleration'):
        element.apply(Disturb(1.01 * hold))
    # met within a tick: the cells swing about where they rest
    rig.ticks(element, Disturb(0.5 * hold), 100)
    assert rig.true_level(element) == BLANK


def noisy(level, deviation, seed=1):
    """Return a device at a level of which the sensors of both ends have white noise."""
    element = rig.device(level, design=CASE_II)
    rig.ticks(rig.set_faults(element, sensor_noise=deviation, seed=seed), 5)
    return element


def test_noise_after_echo_raises_threshold_of_reading():
    """The echo of level 7 comes after 46 ticks: its foot would be lost in noise that began."""
    element = rig.device(7, design=CASE_II)
    rig.ticks(element, Read(), 15)
    rig.set_faults(element, sensor_noise=1e-4, seed=3)
    *echoes, outcome = rig.ticks(element, 200)
    left = next(event.echo for event in echoes if event.echo.end == 'left')
    mean_size = math.sqrt(2.0 / math.pi) * 1e-4  # of normally distributed noise
    assert left.floor == pytest.approx(1.5 * 0.307 * mean_size, rel=0.3)
    assert left.threshold_factor > 1.4
    assert outcome.error.startswith('the noise at the left end hides when the echo began')


@pytest.mark.parametrize(
    ('level', 'deviation'),
    sampled(
        itertools.product((0, 2, 5, 7), (1e-5, 4e-5, 7e-5, 1e-4, 1.5e-4, 2e-4, 3e-4, 5e-4)),
        lambda case: case[0] in {5, 7} and case[1] in {1e-5, 1.5e-4, 3e-4},
    ),
)
@pytest.mark.parametrize('end', ['left', 'right', 'both'])
def test_noise_never_gives_wrong_level(end, level, deviation):
    """From what every read tolerates to what few do."""
    outcome = noisy(level, deviation, seed=level).perform(Read(end))
    assert outcome.success or deviation > 1e-5
    if outcome.success:
        assert outcome.reading.level == level
        assert outcome.end_tick - outcome.start_tick < 200  # noise is not waited for
    else:
        assert 'noise' in outcome.error or 'between levels' in outcome.error


@pytest.mark.parametrize(
    ('omega', 'end'), [(0.05, ''), (0.3, ''), (1.2, ''), (2.1, 'left'), (0.7, 'right')]
)
def test_vibration_within_band_alone_is_waited_for(omega, end):
    """Of 1e-3, six times the left end's threshold. The phase of an end averages over it. Within a
    band the end seems to move as if waves were running, which cannot be told from an echo.
    """
    element = rig.device(3)
    advance, dt = element.chain.advance, element.chain.dt

    def advance_and_vibrate(*arguments):
        ends = advance(*arguments)
        t = element.ticks * 20.0 + np.arange(1, ends.shape[1] + 1) * dt
        return ends + 1e-3 * np.sin(omega * t)

    element.chain.advance = advance_and_vibrate
    rig.ticks(element, 60)
    outcome = element.perform(Read())
    assert outcome.success == (not end)
    if end:
        assert f'may still reach the {end} end' in outcome.error
        assert outcome.end_tick - outcome.start_tick == 300  # read.settle_timeout: 6000 of 20
    else:
        assert outcome.reading.level == 3


G = 9.81e-6


def shaken(element, course, command):
    """Shake a device during a command; return all events."""
    element.apply(command)
    seen = []
    while element.procedure:
        element.apply(Disturb(next(course)))
        seen += element.advance()
    return seen


def test_echo_hidden_by_shaking_is_reported_after_4_pulses():
    """At 30 g and 247 Hz the right end hums: sampled once a tick, it has an image at 469 mrad per
    time unit, of which the carrier filter passes an eighth.
    """
    course = (30.0 * G * math.sin(0.155 * TICK * n) for n in itertools.count(1))
    events = shaken(rig.device(3), course, Read('right'))
    outcome, lost = events[-2:]
    assert lost.reason == 'shaken'
    assert not outcome.success
    assert 'the shaking at the right end hides when the echo began' in outcome.error
    assert len(rig.find_echoes(events)) == 2 * 4  # read.attempts
    assert outcome.reading.level == UNDECODABLE


@pytest.mark.parametrize('moment', sampled(range(1, 25, 2), lambda moment: moment % 4 == 1))
def test_base_that_begins_to_shake_gives_no_wrong_level(moment):
    """At any tick of a read, which takes some 25: at 20 g for a while, then not at all. What an
    end has heard then is spoiled, and the next pulses are fired when it is still again.
    """
    element = rig.device(3)
    messages = 20.0 * G * np.random.default_rng(moment).uniform(-1.0, 1.0, 8)
    events = rig.ticks(element, Read(), moment)
    for acceleration in np.repeat(messages, [2, 3] * 4).tolist():
        events += rig.ticks(element, Disturb(acceleration), 1)
    events += rig.ticks(element, 400)
    outcome = next(event for event in events if isinstance(event, Outcome))
    assert outcome.success, outcome.error
    assert outcome.reading.level == 3
    reasons = [event.reading.reason for event in rig.find_echoes(events)]
    assert any('the base began to shake while' in reason for reason in reasons) or moment > 20


def strides(amplitude, period, seed):
    """Yield the acceleration of a walking body, four harmonics of its stride, tick by tick."""
    random = np.random.default_rng(seed)
    phases, shares = random.uniform(0.0, 2.0 * np.pi, 4), random.uniform(0.3, 1.0, 4)
    angle = 2.0 * np.pi * TICK / period * np.arange(1, 5)
    for tick in itertools.count(1):
        yield float(0.5 * amplitude * (shares * np.sin(angle * tick + phases)).sum())


@pytest.mark.parametrize(('level', 'seed'), [(0, 16), (5, 37)])
def test_wall_that_is_shaken_about_is_at_no_level(level, seed):
    """Ten times what is harmless moves it while pulses are under way: both ends agreed on level 3
    and the wall was near level 4, on 6 and it was half-way to 5.
    """
    told = shaken(rig.device(level, design=CASE_II), strides(1.5e-3, 250.0, seed), Read())
    *_, outcome = (event for event in told if isinstance(event, Outcome))
    assert not outcome.success
    assert outcome.reading.level == UNDECODABLE


def test_scale_gives_unit_of_acceleration():
    """One lattice constant of 1 cm per (0.1 ms)^2 is a million m/s^2."""
    assert ScaleSettings().acceleration == pytest.approx(1e6)
    assert ScaleSettings(time=1e-2, length=1e-2).acceleration == pytest.approx(100.0)


def test_self_test_names_sensor_that_is_too_noisy():
    """At 8e-5 it raises the threshold of the left end's last echo 1.45 times.

    Then nothing is written, since it could not be read.
    """
    element = noisy(0, 8e-5)
    outcome = element.perform(SelfTest())
    assert rig.failed_checks(outcome) == ['transducer left']
    left, right = outcome.checks
    assert left.values['raised'] > 1.4
    assert right.passed
    assert element.actuator.motion.target == 0.0
    assert rig.true_level(element) == 0
