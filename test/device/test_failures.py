# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Failures in the field's words are faults, and a script takes effect in its ticks."""

import json

import numpy as np
import pytest

from mlmem import (
    Faults,
    Inject,
    MemoryElement,
    Read,
    Refused,
    SetFaults,
    Write,
    preset,
    snapshot,
)
from mlmem.instrument.fault_script import (
    FAILURE_KINDS,
    FAULT_MEANINGS,
    FAULT_UNITS,
    Failure,
    list_fault_fields,
    schedule_faults,
)
from mlmem.instrument.faults import Sensors, apply_transducer_faults
from mlmem.physics import HeldCell
from mlmem.rng import Stream, draw_normal

CELL = {'instance': 40}


def script(*failures):
    return Inject(json.dumps(failures))


@pytest.fixture
def element():
    return MemoryElement(preset('bits_1'))


@pytest.mark.parametrize(('unit', 'failure'), FAULT_MEANINGS, ids=' '.join)
def test_failure_is_fault_of_its_unit_and_ok_heals_it(unit, failure):
    cell = CELL if FAULT_MEANINGS[unit, failure].cell else {}
    faults = Failure(unit, failure, **cell).on(Faults(seed=3))
    assert faults.list_active()
    assert set(faults.list_active()) <= set(list_fault_fields(unit))
    assert Failure(unit, 'ok').on(faults) == Faults(seed=3)


def test_failure_without_counterpart_is_rejected():
    others = {(unit, kind) for unit in FAULT_UNITS for kind in FAILURE_KINDS} - {
        (u, 'ok') for u in FAULT_UNITS
    }
    for unit, kind in others - FAULT_MEANINGS.keys():
        with pytest.raises(Refused, match=f'{unit} cannot be {kind}, only .*, or ok'):
            Failure(unit, kind).on(Faults())


@pytest.mark.parametrize(
    ('failures', 'message'),
    [
        ([], 'from 1 to 1000 failures'),
        ([{'unit': 'motor', 'failure': 'off'}], r'script\[0\].unit must be one of sensor'),
        ([{'unit': 'sensor', 'failure': 'off', 'severity': 1}], 'sensor off has no severity'),
        ([{'unit': 'sensor', 'failure': 'wrong', 'severity': 99}], 'sensor_gain must be'),
        ([{'unit': 'sensor', 'failure': 'off', 'instance': 3}], 'no instance 3'),
        ([{'unit': 'material', 'failure': 'stuck'}], 'needs the site of a cell'),
        ([{'unit': 'material', 'failure': 'stuck', 'instance': 9999}], 'stuck_cell must be'),
        ([{'unit': 'sensor', 'failure': 'off', 'tick': 3},
          {'unit': 'sensor', 'failure': 'ok'}], 'ticks of a script must not decrease'),
        ([{'unit': 'sensor', 'failure': 'slow', 'instance': 1},
          {'unit': 'sensor', 'failure': 'ok', 'instance': 2}], 'ok heals all of it'),
        ([{'unit': 'actuator', 'failure': 'ok', 'severity': 1}], 'ok heals all of it'),
        ([{'unit': 'sensor', 'failure': 'slow', 'instance': 1},
          {'unit': 'sensor', 'failure': 'off', 'instance': 2}], 'heal it before that of right'),
    ],
)  # fmt: skip
def test_script_with_mistake_is_rejected_and_changes_nothing(element, failures, message):
    before = snapshot.take_snapshot(element)
    with pytest.raises(Refused, match=message):
        element.apply(script(*failures))
    assert snapshot.take_snapshot(element) == before


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


TRANSDUCER = {
    # failure, instance: level of the read of level 1, levels that a write of 0 may leave
    ('off', 0): (-2, -2), ('off', 1): (-2, -2), ('off', 2): (-2, -2), ('stuck', 1): (-2, -2),
    ('wrong', 1): (1, -1), ('wrong', 0): (1, -1),
}  # fmt: skip


@pytest.mark.parametrize(('failure', 'instance'), TRANSDUCER)
def test_bad_transducer_kicks_no_wall_and_misleads_no_read(failure, instance):
    """At 0.8 of its way a kick launches nothing; a pulse of 0.8 is heard."""
    element = MemoryElement(preset('kick_2'))
    assert element.perform(Write(1)).success
    element.apply(script({'unit': 'transducer', 'failure': failure, 'instance': instance}))
    read, left = TRANSDUCER[failure, instance]
    assert element.perform(Read()).reading.level == read
    written = element.perform(Write(0))
    assert not written.success
    assert (written.reading.level if written.reading else -2) == left
    element.apply(script({'unit': 'transducer', 'failure': 'ok'}))
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
    other = MemoryElement(preset('bits_1'))
    snapshot.restore_snapshot(other, json.loads(json.dumps(kept)))
    assert snapshot.take_snapshot(other) == kept


FAILING = (
    {'unit': 'sensor', 'failure': 'garbage', 'severity': 1e-4, 'tick': 7},
    {'unit': 'sensor', 'failure': 'delayed', 'severity': 7.25, 'tick': 30},
    {'unit': 'material', 'failure': 'slow', 'severity': 1.5, 'tick': 31},
    {'unit': 'sensor', 'failure': 'ok', 'tick': 95},
)


def test_script_takes_effect_in_its_ticks_for_any_cut_of_time():
    """By the whole snapshot: runs, single ticks, and a restored device in the middle of it."""

    def lived(cut):
        element = MemoryElement(preset('bits_1'))
        element.apply(script(*FAILING))
        element.apply(Write(0))
        while element.ticks < 400:
            element.advance(min(cut, 400 - element.ticks))
        return snapshot.take_snapshot(element)

    assert lived(400) == lived(1)


def test_faults_that_are_set_end_script(element):
    element.apply(script({'unit': 'actuator', 'failure': 'stuck', 'tick': 5}))
    element.apply(SetFaults(Faults()))
    while element.ticks < 20:
        element.advance(20)
    assert element.faults == Faults()


def test_later_line_of_same_tick_wins():
    lines = Failure('sensor', 'off', tick=4), Failure('sensor', 'ok', tick=4)
    assert schedule_faults(lines, Faults(), 100) == [(104, Faults())]


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
