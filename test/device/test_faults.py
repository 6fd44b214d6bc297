# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every fault has its stated effect, is detected by the device, and ends when it is healed."""

import dataclasses
import json
import math

import numpy as np
import pytest

from mlmem import (
    UNDECODABLE,
    Abort,
    Erase,
    Faults,
    Read,
    Refused,
    SetFaults,
    SetStrain,
    Settings,
    SettingsError,
    Write,
    factory_calibration,
    new_element,
    snapshot,
)
from mlmem.instrument.actuator import TransmissionState
from mlmem.instrument.end import End
from mlmem.instrument.faults import OfMaterial, apply_faults
from mlmem.move_settings import WriteSettings
from mlmem.physics import CASE_II, Specimen, StateError, find_walls
from mlmem.presets import preset
from mlmem.readers.register import pin_walls
from mlmem.rejections import ErrorCode
from mlmem.rng import Stream, draw_event, draw_normal
from mlmem.schema import find_descriptions

from . import rig
from .test_register import NIBBLE

HEALTHY = SetFaults(Faults())

BIT = preset('bits_1')

PHILOX = [8696173359749182282, 2312520477170885918, 1072409879343043483, 17086100398701728509]
"""The first numbers of key 7 and counter (0, 42, 0, 0)."""


def suffering(element, **faults):
    element.apply(SetFaults(Faults(**faults)))
    return element


def strains(element, n):
    """Return the true strain of the substrate after each of n ticks."""
    seen = []
    for _ in range(n):
        element.advance()
        seen.append(element.chain.V_N / element.design.N)
    return np.array(seen)


# --- as values --------------------------------------------------------------------------------


def test_a_healthy_device_has_no_active_faults():
    assert Faults().list_active() == {}
    assert Faults(seed=3, weak_factor=0.1).list_active() == {}


def test_active_faults_are_reported_by_name():
    assert Faults(sensor_noise=1e-3, weak_cell=7, seed=3).list_active() == {
        'sensor_noise': 1e-3,
        'weak_cell': 7,
    }
    assert Faults(weak_cell=7, weak_factor=0.1).list_active() == {
        'weak_cell': 7,
        'weak_factor': 0.1,
    }


@pytest.mark.parametrize(
    ('wrong', 'message'),
    [
        ({'sensor_noise': math.nan}, 'sensor_noise must be a finite number from 0 to 1; got nan'),
        ({'sensor_dropout': 1.1}, 'sensor_dropout must be'),
        ({'actuator_offset': -0.2}, 'actuator_offset must be'),
        ({'actuator_stuck': 1}, 'actuator_stuck must be true or false; got 1'),
        ({'weak_cell': 2.0}, 'weak_cell must be a whole number'),
        ({'weak_factor': 0.0}, 'weak_factor must be'),
        ({'damping_factor': -1.0}, 'damping_factor must be'),
    ],
)
def test_faults_out_of_range_are_refused(wrong, message):
    with pytest.raises(SettingsError, match=message):
        Faults(**wrong)


@pytest.mark.parametrize(
    'wrong', [{'weak_cell': 126}, {'stuck_cell': 1}, {'stuck_cell': 125}], ids=str
)
def test_faults_of_another_design_are_refused_and_change_nothing(wrong):
    element = suffering(rig.device(2), sensor_noise=1e-6)
    before = rig.bits(element), element.faults, element.chain.specimen
    with pytest.raises(Refused) as rejected:
        suffering(element, **wrong)
    assert rejected.value.code is ErrorCode.CONFLICT
    assert rejected.value.field == f'faults.{next(iter(wrong))}'
    assert (rig.bits(element), element.faults, element.chain.specimen) == before


@pytest.mark.parametrize('field', dataclasses.fields(Faults), ids=lambda field: field.name)
def test_a_fault_of_the_material_is_declared_as_one_and_changes_it(field):
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
        for name in ('alpha_factor', 'k_r_factor', 's_factor', 'stuck', 'eta_factor')
    )
    assert changed == isinstance(row, OfMaterial)
    assert faults.has_same_material(Faults(**others)) != changed
    assert (field.name in faults.list_material_faults()) == changed


def test_a_specimen_that_needs_a_shorter_step_is_refused():
    known = factory_calibration(dataclasses.replace(CASE_II, N=75), Settings())  # of a rigid one
    design = dataclasses.replace(CASE_II, N=75, substrate='elastic')
    element = rig.device(design=design, calibration=known)
    with pytest.raises(Refused, match='faults: the specimen needs a step of at most'):
        suffering(element, disorder_s=0.3)


# --- chance -----------------------------------------------------------------------------------


def test_noise_has_the_stated_statistics():
    """Mean 0, deviation 1, no correlation from tick to tick: within five standard errors."""
    x = np.concatenate(
        [draw_normal((2, 500), 3, tick, Stream.NOISE).ravel() for tick in range(100)]
    )
    n = len(x)
    assert abs(x.mean()) < 5 / math.sqrt(n)
    assert x.std() == pytest.approx(1.0, abs=5 / math.sqrt(2 * n))
    assert abs(np.mean(x[1:] * x[:-1])) < 5 / math.sqrt(n)
    # A normal number is beyond two deviations in 4.55 % of all cases; this sum in 4.6 %.
    assert np.mean(np.abs(x) > 2.0) == pytest.approx(0.0455, abs=0.005)


def test_random_events_have_their_stated_probability():
    for probability in (0.0, 0.3, 1.0):
        seen = np.mean([draw_event(probability, 1, tick, Stream.SLIP) for tick in range(2000)])
        assert seen == pytest.approx(probability, abs=5 * 0.5 / math.sqrt(2000))


def test_the_random_numbers_of_a_seed_and_tick_never_change():
    """Philox4x64-10, whose raw numbers numpy promises; they must not depend on its version."""
    raw = np.random.Philox(key=7, counter=[0, 42, Stream.NOISE, 0]).random_raw(4)
    assert [int(x) for x in raw] == PHILOX
    (x,) = draw_normal((1,), 7, 42, Stream.NOISE)
    halves = [(word >> shift) & 0xFFFF for word in PHILOX for shift in (0, 16, 32, 48)]
    expected = (sum(halves) - 8 * 0xFFFF) / math.sqrt(16 * (2**32 - 1) / 12)
    assert x == pytest.approx(expected, rel=1e-15)


def test_seed_tick_and_purpose_each_change_the_numbers():
    base = draw_normal((4,), 1, 1, Stream.NOISE)
    for other in ((2, 1, Stream.NOISE), (1, 2, Stream.NOISE), (1, 1, Stream.SLIP)):
        assert (draw_normal((4,), *other) != base).all()


# --- sensors ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ('kind', 'end', 'gain'),
    [(BIT, 'left', 0.75), (BIT, 'right', 3.0), (BIT, 'both', 0.0), (NIBBLE, 'left', 3.0)],
    ids=['left', 'right', 'both', 'nibble'],
)
def test_a_read_drives_no_end_that_seems_to_rest_in_neither_phase(kind, end, gain):
    """It is driven about its rest: elsewhere the pulse began with a jump, and the wall left."""
    element = new_element(kind)
    element.chain.place(pin_walls(Specimen(element.design), (0,)))
    suffering(element, sensor_gain=gain, sensor_end=end)
    for _ in range(3):
        element.advance(50)
    outcome = element.perform(Read())
    assert 'rests in neither phase' in outcome.error
    assert outcome.reading.level == UNDECODABLE
    wall = find_walls(element.design, element.chain.configuration)[0]
    assert wall.position == pytest.approx(element.design.defect_site(0), abs=1.0)


@pytest.mark.parametrize('kind', [preset('kick_2'), NIBBLE], ids=['kick_2', 'nibble'])
def test_nor_does_an_erase(kind):
    """It began with a jump of nine cells, which broke the element."""
    element = suffering(new_element(kind), sensor_gain=10.0, sensor_end='right')
    outcome = element.perform(Erase())
    assert not outcome.success
    assert np.abs(element.chain.v).max() < 5.0


def test_noise_is_heard_and_moves_nothing():
    noisy, plain = suffering(rig.device(2), sensor_noise=1e-3), rig.device(2)
    for element in (noisy, plain):
        rig.ticks(element, 20)
    assert snapshot.hash_state(noisy) == snapshot.hash_state(plain)
    heard = noisy.transducer.recent - plain.transducer.recent
    # 80 steps a tick: the whole of the recent samples, two rows of some 300, is noisy
    assert heard.std() == pytest.approx(1e-3, rel=0.15)


def test_loud_noise_hides_the_echo_until_it_stops(written):
    element = suffering(written(3), sensor_noise=0.05)
    outcome = rig.run(element, Read())
    assert not outcome.success
    element.apply(HEALTHY)
    rig.ticks(element, 10)  # until the noise is out of the recent samples, by which it is measured
    assert rig.succeed(element, Read()).level == 3


def test_a_dropped_out_transducer_repeats_its_last_sample():
    element = suffering(rig.device(2), sensor_dropout=1.0)
    element.transducer.fire(End.LEFT)
    last = element.transducer.recent[:, -1].copy()
    rig.ticks(element, 3)
    assert (element.transducer.recent[:, -200:] == last[:, None]).all()
    assert abs(element.chain.end(1) - last[0]) > 1e-4  # while the end really moves


def test_a_read_without_samples_reports_that_it_hears_nothing(written):
    element = suffering(written(3), sensor_dropout=1.0)
    outcome = rig.run(element, Read())
    assert not outcome.success
    assert outcome.error
    element.apply(HEALTHY)
    assert rig.succeed(element, Read()).level == 3


# --- actuator ---------------------------------------------------------------------------------


def test_a_write_with_a_stuck_actuator_fails_with_the_reason(written):
    element = suffering(written(1), actuator_stuck=True)
    outcome = rig.run(element, Write(2))
    assert not outcome.success
    assert 'the actuator does not follow: it is at a strain of 0.0000 instead' in outcome.error
    assert rig.holds(element, 1)
    element.apply(HEALTHY)
    assert rig.succeed(element, Write(2)).level == 2


def test_an_actuator_stuck_under_strain_stays_there_during_an_abort():
    element = rig.device(2)
    element.apply(SetStrain(0.02))
    rig.ticks(element, 15)
    suffering(element, actuator_stuck=True)
    outcome = rig.run(element, Abort())
    assert 'it is at a strain of 0.0200 instead of 0.0000' in outcome.error
    assert strains(element, 1)[0] == pytest.approx(0.02)


def test_a_freed_actuator_moves_to_its_set_point_within_the_rate_limit():
    """From 0 to 0.02 at 1e-4 per time unit: 200 time units, ten ticks."""
    element = suffering(rig.device(2), actuator_stuck=True)
    element.apply(SetStrain(0.02))
    assert (strains(element, 15) == 0.0).all()
    element.apply(HEALTHY)
    seen = strains(element, 12)
    expected = np.minimum(20.0 * 1e-4 * np.arange(1, 13), 0.02)
    np.testing.assert_allclose(seen, expected, atol=1e-12)


def test_an_offset_strains_the_substrate_and_changes_smoothly():
    element = suffering(rig.device(2), actuator_offset=0.01)
    seen = strains(element, 7)
    np.testing.assert_allclose(seen, np.minimum(2e-3 * np.arange(1, 8), 0.01), atol=1e-12)
    assert element.actuator.strain == 0.0  # unknown to the actuator
    element.apply(HEALTHY)
    assert strains(element, 5)[-1] == pytest.approx(0.0, abs=1e-12)
    assert rig.succeed(element, Read()).level == 2


def test_a_lag_follows_by_its_time_constant():
    """After a step of the set-point, 1 - exp(-t / tau) of the way at time t."""
    tau = 400.0
    element = suffering(
        rig.device(2, **rig.with_group('actuator', max_rate=1.0)), actuator_lag=tau
    )
    element.apply(SetStrain(0.01))
    t = element.tick * np.arange(1, 61)
    # the set-point itself takes 0.01 time units, and each sub-step looks at its end: 0.1 of 400
    np.testing.assert_allclose(strains(element, 60), 0.01 * -np.expm1(-t / tau), atol=1e-5)


def test_the_largest_offset_may_come_and_go_without_a_lost_tick():
    """A compression by 0.1 at the highest rate left no cell where a step is stable."""
    settings = preset('case_2').settings
    element = suffering(rig.device(3, **settings.groups()), actuator_offset=-0.1)
    one_way = math.ceil(0.1 / settings.actuator.hand_rate_limit / element.tick)
    assert strains(element, one_way)[-1] == pytest.approx(-0.1)
    element.apply(HEALTHY)
    assert strains(element, one_way)[-1] == pytest.approx(0.0)
    rig.succeed(element, Erase())


def test_a_write_waits_for_an_actuator_that_lags(written):
    plain, lagging = written(1), suffering(written(1), actuator_lag=300.0)
    quick, slow = (rig.run(element, Write(2)) for element in (plain, lagging))
    assert quick.success
    assert slow.success, slow.error
    assert rig.holds(lagging, 2)


def test_a_write_repeats_a_missed_cycle(written):
    """The grip slips unseen by the encoder; the echo shows it, and the write tries again."""
    element = suffering(written(1), missed_cycle=1.0)
    element.apply(Write(2))
    while element.actuator.strain == 0.0:
        element.advance()
    element.apply(HEALTHY)  # this cycle slips all the same: it has begun
    seen = []
    while element.actuator.strain != 0.0:
        seen.extend(strains(element, 1))
    assert seen == [0.0] * len(seen)
    (outcome,) = [event for event in rig.ticks(element, 1200) if hasattr(event, 'attempts')]
    assert outcome.success, outcome.error
    assert outcome.attempts == 2
    assert rig.holds(element, 2)


# --- material ---------------------------------------------------------------------------------


def test_the_material_is_worn_at_the_stated_cells():
    specimen = apply_faults(
        Specimen(CASE_II), Faults(weak_cell=7, weak_factor=0.3, stuck_cell=9, damping_factor=2)
    )
    factor = np.ones(CASE_II.N)
    factor[6] = 0.3
    np.testing.assert_array_equal(specimen.alpha, CASE_II.alpha * factor)
    assert specimen.stuck == (9,)
    assert specimen.eta == 2 * CASE_II.eta


def test_disorder_depends_on_the_seed():
    one, same, other = (
        apply_faults(
            Specimen(CASE_II),
            Faults(disorder_alpha=0.1, disorder_k_r=0.1, disorder_s=0.1, seed=seed),
        )
        for seed in (1, 1, 2)
    )
    np.testing.assert_array_equal(one.alpha, same.alpha)
    np.testing.assert_array_equal(one.k_r, same.k_r)
    np.testing.assert_array_equal(one.s, same.s)
    assert (one.alpha != other.alpha).all()
    # the deviation of 225 numbers is known to 1 / sqrt(450): four of them
    assert np.std(one.alpha / CASE_II.alpha) == pytest.approx(0.1, rel=4 / math.sqrt(450))
    assert np.std(one.k_r) == pytest.approx(0.1, rel=4 / math.sqrt(450))
    assert np.std(one.s / CASE_II.s) == pytest.approx(0.1, rel=4 / math.sqrt(450))


def test_a_weak_cell_off_the_defects_traps_the_wall():
    """Weaker than any defect (1 - 1/20), 12 cells before the target of the wall."""
    element = suffering(
        rig.device(1, write=WriteSettings(attempts=1)), weak_cell=63, weak_factor=0.3
    )
    rig.run(element, Write(2))
    assert not rig.holds(element, 2)


def test_a_stuck_cell_lets_no_wall_pass(written):
    """Further attempts begin with an erase, whose kink leaves more walls behind."""
    element = written(1, write=WriteSettings(attempts=1))
    element.apply(Write(2))
    element.advance()
    suffering(element, stuck_cell=63)  # on its way: before, the write would read what it has
    while element.procedure:
        element.advance()
    assert element.statistics.failures == 1
    assert rig.wall(element) < 64


def test_stronger_damping_hides_far_echoes(written):
    """A wave decays as exp(-eta t / 2): ten times the damping leaves no echo from level 3."""
    element = suffering(written(3), damping_factor=10.0)
    assert not rig.run(element, Read()).success
    element.apply(HEALTHY)
    assert rig.succeed(element, Read()).level == 3


# --- replay -----------------------------------------------------------------------------------

ILL = Faults(
    sensor_noise=2e-6,
    sensor_dropout=0.02,
    actuator_offset=1e-3,
    actuator_lag=50.0,
    missed_cycle=0.3,
    weak_cell=40,
    weak_factor=0.97,
    disorder_alpha=0.002,
    disorder_k_r=0.002,
    disorder_s=0.05,
    damping_factor=1.2,
    seed=11,
)


def test_healthy_faults_leave_every_bit(written):
    plain, set_back = written(2), written(2)
    suffering(set_back, sensor_noise=0.1, weak_cell=3, actuator_lag=3.0)
    set_back.apply(HEALTHY)
    for element in (plain, set_back):
        rig.run(element, Read())  # the content is unknown since faults were set
        rig.run(element, Write(3))
    assert rig.bits(plain) == rig.bits(set_back)


def test_a_faulty_device_restored_in_mid_motion_goes_on_to_the_bit(written):
    once = rig.with_group('write', attempts=1)
    first, second = suffering(written(1, **once), **dataclasses.asdict(ILL)), rig.device(**once)
    first.apply(SetStrain(0.03))
    rig.ticks(first, 9)
    taken = json.loads(json.dumps(snapshot.take_snapshot(first), allow_nan=False))
    snapshot.restore_snapshot(second, taken)
    assert second.faults == ILL
    assert snapshot.take_snapshot(second) == taken
    for element in (first, second):
        rig.ticks(element, 40)
        element.apply(SetStrain(0.0))
        element.told = [rig.plain(event) for event in rig.ticks(element, 60)]
        element.told += [rig.plain(event) for event in rig.events(element, Read())]
    assert first.told == second.told
    assert rig.bits(first) == rig.bits(second)


LINKAGE = dataclasses.asdict(TransmissionState())


@pytest.mark.parametrize(
    ('part', 'values'),
    [
        ('faults', {'weak_cell': 126}),
        ('faults', {'sensor_noise': -1.0}),
        ('faults', {'rust': 1.0}),
        ('faults', None),
        ('linkage', {**LINKAGE, 'encoder_strain': math.nan}),
        ('linkage', {**LINKAGE, 'commanded': 0.01}),
        ('base', {'acceleration': math.inf}),
        ('base', {'acceleration': 'x'}),
        ('base', {'silence': 'x'}),
        ('base', {'silence': 0.5}),
    ],
    ids=str,
)
def test_a_snapshot_with_impossible_faults_is_refused(part, values):
    element = rig.device(1)
    before = rig.bits(element), element.faults
    with pytest.raises(StateError):
        snapshot.restore_snapshot(element, {**snapshot.take_snapshot(rig.device(2)), part: values})
    assert (rig.bits(element), element.faults) == before


@pytest.mark.parametrize('tau', [5e-324, 1e-300, 1e-60, 1e-12])
def test_a_tiny_lag_follows_without_delay(tau):
    """Its exponent is minus infinity, or almost."""
    element = suffering(rig.device(2), actuator_lag=tau)
    twin = rig.device(2)
    for each in (element, twin):
        each.apply(SetStrain(0.01))
    np.testing.assert_allclose(strains(element, 20), strains(twin, 20), rtol=1e-12)
