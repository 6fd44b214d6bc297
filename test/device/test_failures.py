# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Faults of signals and transducers do what they say."""

import json

import numpy as np
import pytest

from mlmem import (
    Faults,
    MemoryElement,
    Read,
    SetFaults,
    Write,
    load_element,
    snapshot,
)
from mlmem.instrument.faults import Sensors, apply_transducer_faults
from mlmem.physics import HeldCell
from mlmem.rng import Stream, draw_normal


@pytest.fixture
def element():
    return MemoryElement(load_element('bits_1'))


def test_signals_are_late_slow_and_wrong_as_stated():
    """A ramp of 0.01 a sample at both ends, samples 0.5 apart: closed forms."""
    ends = np.tile(0.01 * np.arange(1.0, 401.0), (2, 1))

    def sensed(**faults):
        sensors, last, found = Sensors(0.5), np.zeros(2), []
        for tick in range(10):
            part = ends[:, 40 * tick : 40 * tick + 40]
            found.append(sensors.apply_sensor_faults(part, last, Faults(**faults), tick))
            last = found[-1][:, -1]
        return np.concatenate(found, axis=1)

    late = sensed(sensor_delay=25.0, sensor_end='left')
    assert np.array_equal(late[0, 50:], ends[0, :-50])
    assert (late[0, :50] == 0.0).all()
    assert np.array_equal(late[1], ends[1])
    assert np.array_equal(sensed(sensor_gain=-2.0), -2.0 * ends)
    assert not sensed(sensor_off=True).any()
    # Behind a lag of time constant T a ramp is T - dt/2 late, within (dt / T)^2 / 12 of that.
    behind = (ends - sensed(sensor_lag=10.0))[:, -1] / 0.02
    assert behind == pytest.approx(10.0 - 0.25, rel=3e-4)
    # Noise is that of the samples: it does not pass through the lag, from tick to tick neither.
    noisy = sensed(sensor_lag=10.0, sensor_noise=0.1) - sensed(sensor_lag=10.0)
    noise = np.concatenate(
        [draw_normal((2, 40), 0, tick, Stream.NOISE) for tick in range(10)], axis=1
    )
    assert noisy == pytest.approx(0.1 * noise, abs=1e-15)


TRANSDUCER = [
    # faults, level of the read of level 1, level of a write of 0
    ({'transducer_off': True}, -2, -2),
    ({'transducer_off': True, 'transducer_end': 'left'}, -2, -2),
    ({'transducer_off': True, 'transducer_end': 'right'}, -2, -2),
    ({'transducer_gain': 0.0, 'transducer_end': 'left'}, -2, -2),
    ({'transducer_gain': 0.8, 'transducer_end': 'left'}, 1, -1),
    ({'transducer_gain': 0.8}, 1, -1),
]


@pytest.mark.parametrize(('faults', 'read', 'left'), TRANSDUCER)
def test_bad_transducer_kicks_no_wall_and_misleads_no_read(faults, read, left):
    """At 0.8 of its way a kick launches nothing; a pulse of 0.8 is heard."""
    element = MemoryElement(load_element('kick_2'))
    assert element.perform(Write(1)).success
    element.apply(SetFaults(Faults(**faults)))
    assert element.perform(Read()).reading.level == read
    written = element.perform(Write(0))
    assert not written.success
    assert (written.reading.level if written.reading else -2) == left
    element.apply(SetFaults(Faults()))
    assert element.perform(Write(0)).reading.level == 0


def test_motion_is_made_in_part_from_where_it_begins():
    """A kick by half from -1 to 1 ends at 0; its speed is halved, too."""
    asked = HeldCell(1, np.array(((-1.0, 0.0, 1.0), (0.0, 0.3, 0.0))))
    start = asked.motion[:, :1]
    half = apply_transducer_faults(asked, start, Faults(transducer_gain=0.5))
    assert half.motion == pytest.approx(np.array(((-1.0, -0.5, 0.0), (0.0, 0.15, 0.0))))
    assert (
        apply_transducer_faults(asked, start, Faults(transducer_gain=0.5, transducer_end='right'))
        is asked
    )
    assert apply_transducer_faults(asked, start, Faults(transducer_off=True)) is None
    assert apply_transducer_faults(asked, start, Faults(weak_cell=40)) is asked


@pytest.mark.parametrize('after', [0.0, 10.0], ids=['healed', 'sooner'])
def test_signals_that_are_no_longer_late_are_restored(element, after):
    """At rest no sample passes that would tell the sensors of it."""
    element.apply(SetFaults(Faults(sensor_delay=25.0)))
    element.advance(10)
    element.apply(SetFaults(Faults(sensor_delay=after)))
    assert element.at_rest == (after == 0.0)
    kept = snapshot.take_snapshot(element)
    other = MemoryElement(load_element('bits_1'))
    snapshot.restore_snapshot(other, json.loads(json.dumps(kept)))
    assert snapshot.take_snapshot(other) == kept


def test_slow_signal_that_was_healed_begins_at_present_sample():
    """Not where it was when it healed: a lag begins with the last sample before it."""
    sensors, slow, healthy = Sensors(0.5), Faults(sensor_lag=10.0), Faults()
    first, second = np.full((2, 40), 1.0), np.full((2, 40), 3.0)
    sensors.change(slow)
    sensors.apply_sensor_faults(first, np.zeros(2), slow, 0)
    sensors.change(healthy)
    sensors.apply_sensor_faults(second, first[:, -1], healthy, 1)
    sensors.change(slow)
    assert (sensors.apply_sensor_faults(second, second[:, -1], slow, 2) == 3.0).all()
