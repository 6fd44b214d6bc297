# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every fault does what it says, is detected by the device, and ends when it is cleared.

A bad cell that is known belongs to the forecast: what is left is used, the rest refused.
"""

import dataclasses
import itertools
import math

import numpy as np
import pytest
import rig
from suite import expect_rejection, sampled

from mlmem import (
    BLANK,
    UNDECODABLE,
    Calibrate,
    Erase,
    Faults,
    Locate,
    MemoryElement,
    Read,
    Refused,
    SelfTest,
    Settings,
    SettingsError,
    Survey,
    Write,
    element_file,
    load_element,
)
from mlmem.instrument.end import End
from mlmem.instrument.faults import OfMaterial, Sensors, apply_faults
from mlmem.physics import CASE_II, Specimen
from mlmem.readers.bad_cells import list_wall_sets
from mlmem.rng import RandomStream, draw_normal
from mlmem.schema import find_descriptions
from mlmem.snapshot import restore_snapshot
from mlmem_tools import checks
from mlmem_tools.checks import Verdict

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
    value = {'bool': True, 'int': 7}.get(field.type, (row.high, *row.choices)[-1])
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
    element = rig.set_faults(rig.pin(MemoryElement(kind), 0), sensor_gain=gain, sensor_end=end)
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
    assert not element.perform(Erase()).success
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
    element = rig.set_faults(MemoryElement(BIT), sensor_delay=25.0)
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


def test_forecast_wall_sets_stay_within_reached_levels():
    """Behind a wall are two at most two levels apart, at most seven levels away."""
    everything = {
        *itertools.combinations(range(10), 1),
        *((first, first + apart) for first in range(10) for apart in (1, 2)),
        *(
            (first, low, low + apart)
            for first in range(10)
            for low in range(first + 1, first + 8)
            for apart in (1, 2)
        ),
    }
    for reached in (0, 3, 10):
        found = list(list_wall_sets(10, reached))
        assert len(found) == len(set(found))
        assert set(found) == {
            walls for walls in everything if len(walls) == 1 or walls[-1] < reached
        }


def place(element, *levels):
    """Put walls at rest at some levels, unknown to the element."""
    rig.pin(element, *levels)
    element.forget_content('placed')


def true_level(element):
    return rig.true_level(element, 0.5 * element.design.J)


def write_and_read(element, level):
    """Write a level (or erase) and read it; return what was acknowledged, read, and is so."""
    done = element.perform(Erase() if level == BLANK else Write(level))
    read = element.perform(Read())
    return done.success, read.success and read.reading.level, true_level(element)


@pytest.mark.parametrize('method', ['strain', 'kick'])
def test_stuck_cell_near_level_3_leaves_levels_before_it(method):
    """Up, down and blank, by strain and by kicks; without the forecast no read succeeds."""
    element = rig.element_with(
        'case_2', str(rig.STUCK_CELL), Faults(stuck_cell=rig.STUCK_CELL), method
    )
    assert element.reader.forecasts.usable == (0, 1, 2)
    for level in (2, 0, BLANK, 1):
        assert write_and_read(element, level) == (True, level, level)
    with pytest.raises(Refused, match='4 cannot be reached: cell 104 is stuck'):
        element.perform(Write(4))
    with pytest.raises(Refused, match='3 cannot be held: no wall rests there'):
        element.check_arguments(Write(3))
    assert true_level(element) == 1  # a refusal has changed nothing


def test_weak_cell_leaves_levels_reached_in_simulation():
    """Cell 31 holds a wall better than the defects of bits_2 beside it, so none gets past it."""
    element = rig.element_with('bits_2', '31:0.5', Faults(weak_cell=31, weak_factor=0.5))
    assert element.reader.forecasts.usable == (0, 1)
    for level in (1, BLANK, 0):
        assert write_and_read(element, level) == (True, level, level)
    with pytest.raises(Refused, match=r'cannot be reached: cell 31 has 0\.5 of its'):
        element.perform(Write(3))
    place(element, 3)  # as no write can
    assert element.perform(Read()).reading.level == UNDECODABLE
    behind = rig.element_with('bits_1', '62:0.5', Faults(weak_cell=62, weak_factor=0.5))
    assert behind.reader.forecasts.usable == (0, 1)
    place(behind, 1)
    assert behind.perform(Read()).reading.level == 1


@pytest.mark.parametrize(
    ('name', 'cells', 'faults'),
    sampled(
        [
            ('case_2', '104', Faults()),
            *(('case_2', '104', Faults(stuck_cell=cell)) for cell in (103, 106, 47, 135)),
            ('case_2', '104', Faults(weak_cell=104, weak_factor=0.2)),
            *(('case_2', '', Faults(stuck_cell=cell)) for cell in (31, 98, 104)),
            *(('bits_2', '', Faults(stuck_cell=cell)) for cell in (22, 31, 40)),
        ],
        lambda case: case[2].stuck_cell not in {22, 40, 47, 98, 103},
    ),
    ids=lambda each: str(each.list_active()) if isinstance(each, Faults) else None,
)
def test_wrong_knowledge_never_gives_wrong_level(name, cells, faults):
    """Told of a cell that is sound, of another one, or of none."""
    element, wrong = rig.element_with(name, cells, faults), []
    for level in range(BLANK, element.design.levels):
        try:
            place(element, *([] if level == BLANK else [level]))
        except ValueError:  # no wall rests there
            continue
        for end in End:
            read = element.perform(Read(end))
            if read.success and read.reading.level != true_level(element):
                wrong.append((level, end, read.reading.level))
    assert wrong == []


@pytest.mark.parametrize(
    ('cell', 'placed', 'reason'),
    [
        # Two walls have the phases of a blank element, three those of one.
        (rig.STUCK_CELL, [(0, 1), (1, 2), (0, 1, 2)], 'there are {} walls'),
        # The left end hears nothing of them: it read the element as blank.
        (62, [(2, 3), (3, 4), (2, 4), (0, 2, 3)],
         'nothing is known beyond cell 62: the right end hears 2 walls'),
    ],
)  # fmt: skip
def test_more_walls_are_not_taken_for_one_or_none(cell, placed, reason):
    element = rig.element_with('case_2', str(cell), Faults(stuck_cell=cell))
    for walls in placed:
        place(element, *walls)
        read = element.perform(Read())
        assert (read.success, read.reading.level) == (False, UNDECODABLE)
        assert read.error == reason.format(len(walls))


@pytest.mark.parametrize(('name', 'site'), [('case_2', 104), ('case_2', 147), ('bits_2', 66)])
def test_locate_names_stuck_cell_of_blank_element(name, site):
    """To the right end cell 104 sounds like a wall at cell 111; the waveform tells which it is."""
    element = rig.element_with(name, '', Faults(stuck_cell=site))
    assert element.perform(Locate()).found == {'walls': 0, 'stuck_cell': site}


def test_procedures_go_through_levels_that_are_left():
    element = rig.element_with('bits_2', '31', Faults(stuck_cell=31))
    assert element.reader.forecasts.usable == (0, 1)
    assert write_and_read(element, 1) == (True, 1, 1)
    assert element.perform(Locate()).found == {
        'walls': 1, 'position': 18.0, 'position_std': pytest.approx(0.25)
    }  # fmt: skip
    tested = rig.succeed(element, SelfTest())
    tried = [each.name for each in tested.checks if each.name.startswith('level')]
    assert tried == ['level 0', 'level 1']
    assert rig.succeed(element, Calibrate()).reading.level == 1
    assert 'bad_cells must be empty' in element.perform(Survey()).error


def test_design_check_names_levels_behind_a_stuck_cell(monkeypatch):
    design, settings = rig.kind_with('case_2', '')
    element = element_file.Element(Specimen(design, stuck=(rig.STUCK_CELL,)), np.zeros(design.N))
    monkeypatch.setattr(checks, 'CHECK_MODULES', (checks.launch,))  # all else takes a second
    finding = checks.check(design, settings, element)['bad_cells']
    assert (finding.verdict, finding.values['usable levels']) == (Verdict.WARN, 3.0)
    assert 'level 4 cannot be reached: cell 104 is stuck' in finding.text


def test_bad_cells_that_are_none_or_leave_no_level_are_rejected():
    for cells in ('1', '61:', '61:0', '61:nan', 'half'):
        with expect_rejection(SettingsError, 'out_of_range', 'bad_cells'):
            rig.kind_with('case_2', cells)
    for name, cells, code, field in (
        ('case_2', '225', 'conflict', 'bad_cells'),
        ('case_2', '5', 'unsupported', 'element.bad_cells'),
        ('byte', '104', 'conflict', 'element.bad_cells'),
    ):
        with expect_rejection(SettingsError, code, field):
            MemoryElement(*rig.kind_with(name, cells, 'kick'))
    assert Settings().add_stuck_cells((3, 7)).element.stuck_sites == (3, 7)
