# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A strain cycle that is computed in advance is the one that the device makes."""

import dataclasses

import numpy as np
import pytest

from mlmem import Settings
from mlmem.instrument.actuator import Actuator
from mlmem.instrument.blocks import play, run
from mlmem.instrument.instrument import Instrument
from mlmem.instrument.motion import Cycle, Ramp, shape_ramp
from mlmem.move_settings import CycleSettings
from mlmem.physics import CASE_II
from mlmem.settings import ActuatorSettings

PEAK = -0.03
PLAIN = CycleSettings(ramp=400.0, hold=200.0, release=300.0, settle=100.0)
EASED = dataclasses.replace(PLAIN, ease=200.0, ease_to=0.25)


@pytest.mark.parametrize('max_rate', [2e-3, 1e-4])
@pytest.mark.parametrize('times', [PLAIN, EASED])
def test_planned_cycle_equals_that_of_device(times, max_rate):
    """At every tick, with an actuator that follows and with one too slow for the ramps."""
    settings = Settings(actuator=ActuatorSettings(max_rate=max_rate))
    instrument, seen = Instrument(CASE_II, settings), []
    procedure = play(instrument, Cycle.plan_cycle(times, PEAK))
    run(instrument, procedure, lambda: seen.append(instrument.actuator.strain))
    seen = [*seen[1:], instrument.actuator.strain]
    told = Cycle.plan_cycle(times, PEAK, max_rate)
    assert len(seen) * instrument.tick == pytest.approx(told.duration, abs=3 * instrument.tick)
    if max_rate == 2e-3:  # nothing is put off to the next tick
        assert told.duration == 1000.0 + times.ease
        at = instrument.tick * np.arange(1, len(seen) + 1)
        assert told.strain(at) == pytest.approx(seen, abs=1e-12)


def test_slow_actuator_prolongs_ramps_but_not_waits():
    """The peak rate is 1.5 times the mean: 1.5 x 0.03 / 1e-5 for each ramp."""
    told = Cycle.plan_cycle(PLAIN, PEAK, 1e-5)
    assert told.duration == pytest.approx(2 * 4500.0 + 200.0 + 100.0)
    bare = Cycle.plan_cycle(dataclasses.replace(PLAIN, hold=0.0, settle=0.0), PEAK)
    assert bare.duration == 700.0
    assert bare.strain(np.array([0.0, 400.0, 700.0])) == pytest.approx([0.0, PEAK, 0.0])


def test_pulse_of_any_shape_is_cycle_and_one_profile():
    """Up, hold, fast to a small opposite strain, and to zero: each leg is a smooth ramp."""
    legs = [(PEAK, 400.0), (PEAK, 60.0), (-0.1 * PEAK, 20.0), (0.0, 20.0)]
    pulse = Cycle.build_from_targets(legs)
    t = np.linspace(0.0, 520.0, 5201)
    seen = pulse.strain(t)
    assert pulse.duration == 500.0
    assert seen[[0, 4000, 4600, 4800, 5000, 5200]] == pytest.approx(
        [0.0, PEAK, PEAK, -0.1 * PEAK, 0.0, 0.0], abs=1e-15
    )
    moved = Actuator(ActuatorSettings(max_rate=1.0))
    moved.motion = pulse.profile
    assert moved.advance(t) == pytest.approx(seen, abs=1e-15)
    ramps = np.concatenate([each.strain(np.arange(0.0, each.duration)) for each in pulse.motions])
    assert pulse.strain(np.arange(500.0)) == pytest.approx(ramps, abs=1e-15)


@pytest.mark.parametrize('delay', [6.7, 40.0, 55.0])
def test_move_in_two_half_steps_is_mean_of_two_moves(delay):
    """Also if the second begins after the first has ended."""
    ramp, t = Ramp(0.01, PEAK, 40.0), np.linspace(0.0, 120.0, 1201)
    moved = shape_ramp(ramp, delay)
    assert moved.duration == 40.0 + delay
    assert moved.target == PEAK
    late = np.where(t < delay, ramp.start, ramp.strain(np.maximum(t - delay, 0.0)))
    assert moved.strain(t) == pytest.approx(0.5 * (ramp.strain(t) + late), abs=1e-15)


def test_two_half_steps_leave_oscillator_of_period_at_rest():
    """What rings after a move is the Fourier transform of its rate at that frequency."""
    ramp, delay = Ramp(0.0, PEAK, 50.0), 6.7
    t = np.arange(0.0, 60.0, 0.01)

    def rings(motion, omega):
        return abs(np.sum(np.gradient(motion.strain(t)) * np.exp(1j * omega * t)))

    assert rings(shape_ramp(ramp, delay), np.pi / delay) < 1e-4 * rings(ramp, np.pi / delay)
    assert rings(shape_ramp(ramp, delay), 0.1) > 0.9 * rings(ramp, 0.1)
    actuator = Actuator(ActuatorSettings(max_rate=1.0))
    actuator.ramp_to(PEAK, 40.0, delay)
    assert actuator.remaining_time == pytest.approx(40.0)
    actuator.ramp_to(0.0, 5.0, delay)  # too short for it
    assert actuator.remaining_time == 5.0
