# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Delay tables, their measurement, the factory calibration, and corrections of pulses."""

import dataclasses
import math

import numpy as np
import pytest
import rig
from suite import expect_rejection

from mlmem import (
    BLANK,
    Abort,
    Calibrate,
    Calibration,
    DelayTable,
    ProcedureFailed,
    Settings,
    SettingsError,
    Specimen,
    Write,
    compute_calibration,
    factory_calibration,
    load_element,
    snapshot,
)
from mlmem.instrument.end import End
from mlmem.moves.strain_cycle import correct_write
from mlmem.physics import CASE_II, Scatter, draw_specimen
from mlmem.physics.equilibrium import find_pinned_wall, make_blank
from mlmem.procedures import writing
from mlmem.readers import listening
from mlmem.readers.calibration import PulseCorrection, PulseCorrections, hash_schedule
from mlmem_tools.checks.echoes import forecast_echo

RISING = DelayTable((100.0, 200.0, 320.0, 400.0))
FALLING = DelayTable((400.0, 320.0, 200.0, 100.0), blank=500.0)


@pytest.mark.parametrize('delays', [(1.0, 2.0, 2.0), (1.0, 3.0, 2.0)])
def test_end_that_names_level_must_tell_all_apart(delays):
    """The other end only confirms it: two levels near it may have the same delay."""
    alike, apart = DelayTable(delays), DelayTable((1.0, 2.0, 3.0))
    Calibration(alike, apart).check(3, End.RIGHT)
    Calibration(apart, alike).check(3, End.LEFT)
    Calibration(alike, alike).check(3)
    for other in (2, 4):
        with expect_rejection(SettingsError, 'conflict', 'left') as refusal:
            Calibration(apart, apart).check(other)
        assert refusal.value.value == 3
    for tables, first in (((alike, apart), End.LEFT), ((apart, alike), End.RIGHT)):
        with expect_rejection(SettingsError, 'conflict', 'delays'):
            Calibration(*tables).check(3, first)


def test_computed_delays_are_those_of_the_specimen():
    """Waves in springs that are stiffer by 2 % arrive earlier by 1 %. The element stays blank."""
    element = rig.shipped('bits_1')
    designed = element.calibration.right.delays
    stiffer = Specimen(element.design, k_r_factor=1.02)
    computed = compute_calibration(stiffer, element.design, element.settings).right.delays
    assert (np.subtract(designed, computed) > 1.4).all()
    element.chain.set_specimen(stiffer)
    assert rig.succeed(element, Calibrate()).reading.level == BLANK
    assert rig.true_level(element) == BLANK
    assert computed == pytest.approx(element.calibration.right.delays, abs=1.0)


@pytest.mark.parametrize('blank', [math.nan, math.inf, 200.0])
def test_blank_delay_equal_to_level_is_rejected(blank):
    """But for level 0, which the phase of the left end tells from it."""
    with expect_rejection(SettingsError, 'out_of_range', 'blank'):
        DelayTable(RISING.delays, blank)
    with expect_rejection(SettingsError, 'out_of_range', 'shapes'):
        DelayTable(RISING.delays, shapes=((None, math.nan, 1.0),) * 4)
    assert DelayTable(FALLING.delays, blank=400.0).find_nearest(400.0, -1) == (0, 1.0)
    assert DelayTable(FALLING.delays, blank=400.0).find_nearest(400.0, 0) == (-1, 1.0)


ONE = DelayTable((200.0,))


@pytest.mark.parametrize(
    ('table', 'delay', 'level', 'margin'),
    [
        *((RISING, delay, level, 1.0) for level, delay in enumerate(RISING.delays)),
        *((FALLING, delay, level, 1.0) for level, delay in enumerate(FALLING.delays)),
        (RISING, 149.999, 0, 0.0),  # half-way
        (RISING, 150.001, 1, 0.0),
        (RISING, 125.0, 0, 0.5),  # a quarter of the way
        (RISING, 260.001, 2, 0.0),
        (RISING, 230.0, 1, 0.5),  # 30 of 120: the spacing on the side where it lies counts
        (RISING, 180.0, 1, 0.6),  # 20 of 100
        (RISING, 380.0, 3, 0.5),  # 20 of 80
        (RISING, 50.0, 0, 0.0),  # beyond the end the nearest spacing is the measure
        (RISING, 0.0, 0, -1.0),
        (RISING, 440.0, 3, 0.0),
        (RISING, 480.0, 3, -1.0),
        (FALLING, 500.0, -1, 1.0),  # blank is an entry like the others
        (FALLING, 460.0, -1, 0.2),
        (FALLING, 440.0, 0, 0.2),
        (FALLING, 560.0, -1, -0.2),  # 60 off, half the spacing is 50
        (ONE, 200.0, 0, 1.0),  # a single level is judged by its own delay
        (ONE, 250.0, 0, 0.5),
        (ONE, 350.0, 0, -0.5),
    ],
)
def test_margin_falls_to_0_half_way_to_neighbour(table, delay, level, margin):
    found, clear = table.find_nearest(delay)
    assert found == level
    assert clear == pytest.approx(margin, abs=1e-4)  # some delays are 0.001 off half-way


@pytest.mark.parametrize(
    ('table', 'level', 'offset', 'spacing', 'margin'),
    [
        (RISING, 1, 0.0, 0.0, 1.0),
        (RISING, 1, 25.0, 0.0, 0.5),  # the spacings about it are 100, 120 and 80: a quarter of 100
        (RISING, 2, -70.0, 0.0, -0.4),  # a level that it is not
        (RISING, 3, -300.0, 0.0, -5.0),
        (DelayTable((100.0, 101.0)), 0, 1.0, 80.0, 1.0 - 2.0 / 80.0),  # that of the fastest waves
        (DelayTable((100.0,)), 0, 20.0, 80.0, 0.5),
    ],
)
def test_level_is_confirmed_by_median_spacing_about_it(table, level, offset, spacing, margin):
    assert table.margin(level, offset, spacing) == pytest.approx(margin)


def test_calibration_is_close_to_factorys_and_keeps_content(written):
    element = written(3)
    factory = element.calibration
    assert rig.succeed(element, Calibrate()).reading.level == 3
    assert rig.true_level(element) == 3
    assert element.calibration != factory
    for end in End:
        known, new = factory.table(end).delays, element.calibration.table(end).delays
        # a wall that came by strain still creeps by a tenth of a cell; levels are 25 apart
        np.testing.assert_allclose(new, known, atol=0.1 * np.abs(np.diff(known)).max())
    assert element.calibration.right.blank == pytest.approx(factory.right.blank, abs=5.0)
    assert rig.succeed(element, Write(2)).reading.level_margin > 0.9  # and it can be used
    assert rig.true_level(element) == 2


def test_calibration_that_fails_restores_content(written, monkeypatch):
    """The wall does not follow to level 2, while it is calibrated, and stays at level 1."""
    element, go_to_level = written(3), writing.go_to_level
    known = element.calibration

    def lame(element, place, level, *force, **how):
        yield from go_to_level(element, place, place if level == 2 else level, *force, **how)

    monkeypatch.setattr(writing, 'go_to_level', lame)
    outcome = element.perform(Calibrate())
    assert not outcome.success
    assert 'on the way to level 2 the left end hears level 1' in outcome.error
    assert outcome.reading.level == 3
    assert rig.true_level(element) == 3
    assert element.calibration is known


@pytest.mark.parametrize('name', ['kick_2', 'robust_2_friction', 'robust_3_one_end'])
def test_aborted_calibration_keeps_old_one(name):
    """Of delays, waveforms and records; its first factors on the kicks are far off."""
    element = rig.shipped(name)
    known, reader = element.calibration, element.reader
    element.apply(Calibrate())
    while element.calibration is known:
        assert element.procedure
        element.advance(20)
    assert element.perform(Abort()).success
    assert element.calibration is known
    assert element.reader is reader


def test_calibration_that_is_not_verified_keeps_old_one(monkeypatch):
    """Factors on losses and kicks are found, but no level is written with them."""
    element = rig.shipped('robust_2_friction')
    known, seen = element.calibration, []

    def fail(element, level):
        seen.append(element.calibration)
        raise ProcedureFailed('as planted')
        yield

    monkeypatch.setattr(writing, 'write', fail)
    assert not element.perform(Calibrate()).success
    assert seen[0] is not known
    assert element.calibration is known


@pytest.mark.parametrize('names', ['left', 'right'])
def test_end_without_echoes_gives_no_calibration(written, names):
    """The left one's threshold is a cell: no level is confirmed."""
    element = written(1, read={'end': names}, write={'attempts': 1}, probe={'v_th': 1.0})
    factory = element.calibration
    assert 'level 0 gives no echo at the left end' in element.perform(Calibrate()).error
    assert element.calibration is factory


@pytest.mark.parametrize('end', list(End))
def test_delays_are_those_of_linear_waves(end):
    """Another route to them: the equation of motion, linearised about the wall and solved for
    every frequency, without steps. Its samples are 0.25 apart, those of the device 0.5. To the
    right end a blank element echoes from its far end; to the left one it is silent.
    """
    settings = Settings()
    table = factory_calibration(CASE_II, settings).table(end)
    walls = {delay: find_pinned_wall(CASE_II, level) for level, delay in enumerate(table.delays)}
    assert (table.blank is None) == (end is End.LEFT)
    if table.blank:
        walls[table.blank] = make_blank(CASE_II)
    for delay, wall in walls.items():
        exact = forecast_echo(CASE_II, wall, end.select_probe(settings), end, dt=0.0).delay
        assert delay == pytest.approx(exact, abs=1.5)


BITS_2 = load_element('bits_2')
PLAN = PulseCorrections(
    (PulseCorrection(), *[PulseCorrection(1.3, 1.6)] * 3), hash_schedule(BITS_2.settings)
)
"""Pulses that reach every level of the scattered element."""


def scattered_element(plan=None):
    """Return an element whose cells differ by 1.5 per cent, so that the wall stops on its way."""
    element = rig.shipped('bits_2')
    element.chain.set_specimen(draw_specimen(BITS_2.design, Scatter(alpha=0.015), 12))
    element.calibration = dataclasses.replace(element.calibration, pulse_corrections=plan)
    return element


def failed_writes(element):
    """Write all levels from the lowest, and return those that fail or are wrong."""
    return [
        level
        for level in range(element.design.levels)
        if not element.perform(Write(level)).success or rig.true_level(element) != level
    ]


def test_writes_with_planned_corrections_succeed():
    """The plan outlives a calibration, and the process."""
    assert failed_writes(scattered_element()) == [1]
    planned, again = scattered_element(PLAN), scattered_element()
    assert planned.perform(Calibrate()).success
    assert planned.calibration.pulse_corrections == PLAN
    snapshot.restore_snapshot(again, rig.save_state(planned))
    assert again.calibration == planned.calibration
    assert not failed_writes(planned)


def test_corrections_of_another_schedule_are_ignored():
    known = scattered_element(PLAN).calibration
    settings = BITS_2.settings
    assert known.corrections_by_level(settings) == list(PLAN.steps)
    for change in ({'ramp': 150.0}, {'tension': 0.025}, {'start_strain': 0.021}):
        changed = rig.change(settings, write=change)
        assert known.corrections_by_level(changed) == [PulseCorrection()] * BITS_2.design.levels
    more = rig.change(settings, write={'attempts': 9})
    assert known.corrections_by_level(more) == list(PLAN.steps)


def test_correction_scales_strains_within_actuators_limit():
    known, limit = BITS_2.settings.write, BITS_2.settings.actuator.max_strain
    write = correct_write(known, PulseCorrection(peak=7.0, times=0.5), limit)
    assert write.ramp == 0.5 * known.ramp
    assert write.ease_to == known.ease_to
    assert write.compression == -limit
    assert correct_write(known, PulseCorrection(), limit) == known


def test_ideal_element_that_cannot_be_probed_is_rejected(monkeypatch):
    def wait_in_vain(element):
        raise ProcedureFailed('the left end does not come to rest')
        yield

    monkeypatch.setattr(listening, 'wait_for_decay', wait_in_vain)
    with expect_rejection(SettingsError, 'unsupported', 'probe'):
        factory_calibration(CASE_II, rig.change(Settings(), read={'settle_timeout': 100.0}))
