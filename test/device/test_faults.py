# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every fault does what it says, is detected by the device, and ends when it is cleared."""

import dataclasses
import math

import numpy as np
import pytest
from rejection import expect_rejection

from mlmem import UNDECODABLE, Erase, Faults, MemoryElement, Read, Refused, Write, load_element
from mlmem.instrument.end import End
from mlmem.instrument.faults import OfMaterial, Sensors, apply_faults
from mlmem.physics import CASE_II, Specimen
from mlmem.rng import RandomStream, draw_normal
from mlmem.schema import find_descriptions
from mlmem.snapshot import restore_snapshot

from . import rig

BIT = load_element('bits_1')

BITS = rig.first_levels('byte', 2)


def strains(element, n):
    """Return the true strain of the substrate after each of n ticks."""
    seen = []
    for _ in range(n):
        element.advance()
        seen.append(element.chain.V_N / element.design.N)
    return np.array(seen)


@pytest.mark.parametrize(
    'wrong', [{'weak_cell': 126}, {'stuck_cell': 1}, {'stuck_cell': 125}], ids=str
)
def test_faults_of_another_design_are_rejected_whole(wrong):
    element = rig.set_faults(rig.device(2), sensor_noise=1e-6)
    before = rig.bits(element), element.faults, element.chain.specimen
    with expect_rejection(Refused, 'conflict', f'faults.{next(iter(wrong))}'):
        rig.set_faults(element, **wrong)
    assert (rig.bits(element), element.faults, element.chain.specimen) == before


@pytest.mark.parametrize('field', dataclasses.fields(Faults), ids=lambda field: field.name)
def test_fault_of_material_is_declared_as_one_and_changes_it(field):
    """And no other does."""
    (row,) = (row for each, row in find_descriptions(Faults) if each.name == field.name)
    others = {'weak_cell': 7} if field.name == 'weak_factor' else {}
    last = (row.high, *row.choices)[-1]
    value = {'bool': True, 'int': 7}.get(field.type, last)
    faults = Faults(**{**others, field.name: value})
    made = Specimen(CASE_II)
    before = apply_faults(made, Faults(**others))
    after = apply_faults(made, faults)
    changed = any(
        np.any(getattr(before, name) != getattr(after, name))
        for name in ('alpha_factor', 'k_r_factor', 's_factor', 'depth', 'stuck', 'eta_factor')
    )
    assert changed == isinstance(row, OfMaterial)
    assert faults.has_same_material(Faults(**others)) != changed
    assert (field.name in faults.list_material_faults()) == changed


def test_specimen_that_needs_shorter_step_is_rejected():
    element = rig.device(design=dataclasses.replace(CASE_II, N=75, substrate='elastic'))
    with expect_rejection(Refused, 'conflict', 'faults'):
        rig.set_faults(element, disorder_s=0.3)


def test_random_numbers_of_seed_and_tick_never_change():
    """Philox4x64-10, whose raw numbers numpy promises; they must not depend on its version."""
    words = [8696173359749182282, 2312520477170885918, 1072409879343043483, 17086100398701728509]
    raw = np.random.Philox(key=7, counter=[0, 42, RandomStream.NOISE, 0]).random_raw(4)
    assert [int(x) for x in raw] == words
    (x,) = draw_normal((1,), 7, 42, RandomStream.NOISE)
    halves = [(word >> shift) & 0xFFFF for word in words for shift in (0, 16, 32, 48)]
    expected = (sum(halves) - 8 * 0xFFFF) / math.sqrt(16 * (2**32 - 1) / 12)
    assert x == pytest.approx(expected, rel=1e-15)


@pytest.mark.parametrize(
    ('kind', 'end', 'gain'),
    [(BIT, 'left', 0.75), (BIT, 'right', 3.0), (BIT, 'both', 0.0), (BITS, 'left', 3.0)],
    ids=['left', 'right', 'both', 'register'],
)
def test_read_drives_no_end_that_rests_in_neither_phase(kind, end, gain):
    """It is driven about its rest: elsewhere the pulse began with a jump, and the wall left."""
    element = rig.pin(MemoryElement(kind), 0)
    rig.set_faults(element, sensor_gain=gain, sensor_end=end)
    rig.ticks(element, 150)
    outcome = element.perform(Read())
    assert 'rests in neither phase' in outcome.error
    assert outcome.reading.level == UNDECODABLE
    assert rig.true_level(element) == 0


@pytest.mark.parametrize(
    ('kind', 'end'),
    [(load_element('kick_2'), 'right'), (BITS, 'left')],
    ids=['kick_2', 'register'],
)
def test_erase_drives_no_end_that_rests_in_neither_phase(kind, end):
    """It began with a jump of nine cells, which broke the element."""
    element = rig.set_faults(MemoryElement(kind), sensor_gain=10.0, sensor_end=end)
    outcome = element.perform(Erase())
    assert not outcome.success
    assert np.abs(element.chain.v).max() < 5.0


def test_dropped_out_transducer_repeats_its_last_sample():
    element = rig.set_faults(rig.device(2), sensor_dropout=1.0)
    element.transducer.fire_probe(End.LEFT)
    last = element.transducer.recent[:, -1].copy()
    rig.ticks(element, 3)
    assert (element.transducer.recent[:, -200:] == last[:, None]).all()
    assert abs(element.chain.end(1) - last[0]) > 1e-4  # while the end really moves


def test_offset_strains_substrate_and_changes_smoothly():
    element = rig.set_faults(rig.device(2), actuator_offset=0.01)
    seen = strains(element, 7)
    np.testing.assert_allclose(seen, np.minimum(2e-3 * np.arange(1, 8), 0.01), atol=1e-12)
    assert element.actuator.strain == 0.0  # unknown to the actuator
    rig.set_faults(element)
    assert strains(element, 5)[-1] == pytest.approx(0.0, abs=1e-12)
    assert rig.succeed(element, Read()).reading.level == 2


def test_lag_follows_by_its_time_constant():
    """After a step of the set-point, 1 - exp(-t / tau) of the way at time t."""
    tau = 400.0
    element = rig.set_faults(rig.device(2, actuator={'max_rate': 1.0}), actuator_lag=tau)
    element.actuator.slew_to(0.01)
    t = element.tick * np.arange(1, 61)
    # the set-point itself takes 0.01 time units, and each sub-step looks at its end: 0.1 of 400
    np.testing.assert_allclose(strains(element, 60), 0.01 * -np.expm1(-t / tau), atol=1e-5)


def test_write_repeats_missed_cycle(written):
    """The grip slips unseen by the encoder; the echo shows it, and the write tries again."""
    element = rig.set_faults(written(1), missed_cycle=1.0)
    element.apply(Write(2))
    while element.actuator.strain == 0.0:
        element.advance()
    rig.set_faults(element)  # this cycle slips all the same: it has begun
    seen = []
    while element.actuator.strain != 0.0:
        seen.extend(strains(element, 1))
    assert seen == [0.0] * len(seen)
    (outcome,) = [event for event in rig.ticks(element, 1200) if hasattr(event, 'attempts')]
    assert outcome.success, outcome.error
    assert outcome.attempts == 2
    assert rig.true_level(element) == 2


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
        [draw_normal((2, 40), 0, tick, RandomStream.NOISE) for tick in range(10)], axis=1
    )
    assert noisy == pytest.approx(0.1 * noise, abs=1e-15)


@pytest.mark.parametrize(
    ('faults', 'read', 'left'),  # level of the read of level 1, level after a write of 0
    [
        ({'transducer_off': True}, -2, -2),
        ({'transducer_off': True, 'transducer_end': 'left'}, -2, -2),
        ({'transducer_off': True, 'transducer_end': 'right'}, -2, -2),
        ({'transducer_gain': 0.0, 'transducer_end': 'left'}, -2, -2),
        ({'transducer_gain': 0.8, 'transducer_end': 'left'}, 1, -1),
        ({'transducer_gain': 0.8}, 1, -1),
    ],
)
def test_bad_transducer_kicks_no_wall_and_misleads_no_read(faults, read, left):
    """At 0.8 of its way a kick launches nothing; a pulse of 0.8 is heard."""
    element = rig.shipped('kick_2', actuator={'present': False})
    assert element.perform(Write(1)).success
    rig.set_faults(element, **faults)
    assert element.perform(Read()).reading.level == read
    written = element.perform(Write(0))
    assert not written.success
    assert (written.reading.level if written.reading else -2) == left
    rig.set_faults(element)
    assert element.perform(Write(0)).reading.level == 0


@pytest.mark.parametrize('after', [0.0, 10.0], ids=['healed', 'sooner'])
def test_signals_that_are_no_longer_late_are_restored(after):
    """At rest no sample passes that would tell the sensors of it."""
    element = MemoryElement(BIT)
    rig.set_faults(element, sensor_delay=25.0)
    element.advance(10)
    rig.set_faults(element, sensor_delay=after)
    assert element.at_rest == (after == 0.0)
    other, kept = MemoryElement(BIT), rig.save_state(element)
    restore_snapshot(other, kept)
    assert rig.save_state(other) == kept


def test_slow_signal_that_was_healed_begins_at_present_sample():
    """Not where it was when it healed: a lag begins with the last sample before it."""
    sensors, slow, healthy = Sensors(0.5), Faults(sensor_lag=10.0), Faults()
    first, second = np.full((2, 40), 1.0), np.full((2, 40), 3.0)
    sensors.change_faults(slow)
    sensors.apply_sensor_faults(first, np.zeros(2), slow, 0)
    sensors.change_faults(healthy)
    sensors.apply_sensor_faults(second, first[:, -1], healthy, 1)
    sensors.change_faults(slow)
    assert (sensors.apply_sensor_faults(second, second[:, -1], slow, 2) == 3.0).all()


def test_seed_and_factor_of_no_cell_are_no_faults():
    """A seed changes the material only with disorder."""
    assert Faults(seed=3, weak_factor=0.1).list_active() == {}
    weak = {'weak_cell': 7, 'weak_factor': 0.1}
    assert Faults(**weak).list_active() == weak
    assert Faults(seed=1).has_same_material(Faults(seed=2))
    one, other = (Faults(disorder_alpha=0.1, seed=seed) for seed in (1, 2))
    assert not one.has_same_material(other)
