# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The robust elements: written by kicks, read by waveforms of two ends or of one alone."""

import dataclasses

import numpy as np
import pytest
import rig
from suite import expect_rejection

from mlmem import (
    BLANK,
    UNDECODABLE,
    Calibrate,
    Erase,
    Faults,
    MemoryElement,
    Read,
    Refused,
    Reset,
    Survey,
    Write,
    load_element,
)
from mlmem.instrument.drivers import Simulation
from mlmem.instrument.end import End
from mlmem.physics import Scatter, draw_specimen, find_walls
from mlmem.physics.wall import arrival_tolerance
from mlmem.snapshot import restore_snapshot
from mlmem_tools.checks import Verdict, check

SCATTER = Scatter(alpha=0.03, k_r=0.03, mass=0.03)


def make_scattered(name, seed, scatter=SCATTER):
    """Return an element whose parts scatter, with the settings of its file alone."""
    return rig.shipped(name, draw_specimen(load_element(name).design, scatter, seed))


@pytest.mark.parametrize('name', rig.ROBUST_NAMES)
@pytest.mark.parametrize('seed', range(2))
def test_scattered_robust_element_acknowledges_no_wrong_level(name, seed):
    """The wall must rest within a quarter of a level, at most 1.5 cells, where it is reported."""
    element, random = make_scattered(name, seed), np.random.default_rng(1000 + seed)
    design, written = element.design, 0
    for level in map(int, random.integers(design.levels, size=8)):
        if element.perform(Write(level)).success:
            assert rig.true_level(element, arrival_tolerance(design)) == level
            written += 1
    assert written >= 6


@pytest.mark.parametrize('seed', [709, 730])
def test_wall_pinned_behind_the_last_level_is_not_read_as_it(seed):
    """Parts that scatter by 5 % pin the wall five cells behind the last level of these two."""
    element = make_scattered('robust_2', seed, Scatter(alpha=0.05, k_r=0.05, mass=0.05))
    design = element.design
    outcome = element.perform(Write(design.levels - 1))
    (wall,) = find_walls(design, element.chain.configuration)
    assert wall.position > design.defect_site(design.levels - 1) + 0.5 * design.J
    assert not outcome.success
    reading = element.perform(Read()).reading
    assert (reading.content, reading.walls) == (UNDECODABLE, 1)


@pytest.mark.parametrize('name', rig.ROBUST_NAMES)
def test_robust_element_passes_design_check(name):
    """A node refuses an element whose check fails, and logs what warns at every start."""
    shipped = load_element(name)
    report = check(shipped.design, shipped.settings)
    assert [each.name for each in report.findings if each.verdict is not Verdict.PASS] == []


@pytest.mark.parametrize('name', ['robust_3', 'robust_2_friction'])
def test_waveform_read_of_two_walls_is_undecodable(name):
    """The phases of the ends are those of a blank element, and some pairs answer nearly as it."""
    element = MemoryElement(load_element(name))
    for level in range(element.design.levels - 2):
        rig.pin(element, level, level + 2)
        assert not element.perform(Read()).success, level
        assert element.reading.content == UNDECODABLE


def lossy(name, factor):
    """Return an element whose damping and friction are so many times those of its design."""
    design = load_element(name).design
    losses = {'eta': factor * design.eta, 'friction': factor * design.friction}
    return rig.shipped(name, dataclasses.replace(design, **losses))


@pytest.mark.parametrize(('name', 'losses'), [('robust_2', 0.8), ('robust_2_friction', 1.3)])
def test_calibration_finds_factors_on_losses_and_kicks(name, losses):
    """A wall that loses less or more needs slower or faster kicks, and answers otherwise, so that
    it is also read better. With less damping every kick to the last level sends the wall out.
    """
    element = lossy(name, losses)
    missed = element.perform(Write(element.design.levels - 1))
    assert not missed.success
    assert ('calibrate the element' in missed.error) == (losses < 1.0)
    before = rig.pin(element, 1).perform(Read()).reading.threshold_margin
    outcome = rig.succeed(element, Calibrate())
    assert (outcome.end_tick - outcome.start_tick) * element.settings.tick_seconds < 60.0
    assert outcome.found['loss_factor'] == pytest.approx(losses, abs=0.05)
    assert (outcome.found['kick_factor'] > 1.0) == (losses > 1.0)
    for level in (*range(element.design.levels), 1):
        assert rig.succeed(element, Write(level)).attempts == 1
    restored = lossy(name, losses)
    restore_snapshot(restored, rig.save_state(element))
    for each in (element, restored):
        assert each.perform(Read()).reading.threshold_margin > 2.0 * before


def run_out(element):
    """Return an element whose wall has left it at the right end."""
    return rig.settle(element, np.full(element.design.N, element.design.D_s2))


@pytest.mark.parametrize('name', rig.ROBUST_NAMES)
def test_wall_that_left_is_kicked_back_by_the_right_end_and_erased(name):
    element = run_out(make_scattered(name, 1))
    assert rig.succeed(element, Erase()).attempts == 1
    assert find_walls(element.design, element.chain.configuration) == []


def test_kick_after_a_wall_left_is_slower():
    """With a tenth less damping the wall passes the last level of eight."""
    assert rig.succeed(lossy('robust_3', 0.9), Write(7)).attempts == 2


def test_calibration_without_a_blank_element_keeps_the_old_factors():
    """The wall has left the element, and no end is driven."""
    element = rig.set_faults(run_out(make_scattered('robust_2', 1)), transducer_off=True)
    known = element.calibration
    outcome = element.perform(Calibrate())
    assert not outcome.success
    assert 'the element is not blank after 3 kicks' in outcome.error
    assert element.calibration == known


def waveform_reader(name):
    """Return an element that is read by waveforms, and contents of it."""
    if name == 'nibble':
        return MemoryElement(rig.first_levels('byte', 4)), (0x0, 0x2, 0x5, 0x9, 0xF)
    if name == 'stuck cell':
        element = rig.element_with(
            'case_2', str(rig.STUCK_CELL), Faults(stuck_cell=rig.STUCK_CELL)
        )
        return element, element.reader.forecasts.usable
    element = make_scattered(name, 1)
    return element, range(element.design.levels)


def record_shots(element, contents):
    """Return what `decode` is given in sound reads of some contents: shots, noise, phases."""
    given, forecasts = [], element.reader.forecasts
    decode = forecasts.decode
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(forecasts, 'decode', lambda *each: given.append(each) or decode(*each))
        for content in contents:
            element.place_content(content)
            element.forget_content('placed')
            assert rig.succeed(element, Read()).reading.level == content
    return given


def delay_end(shot, end, late):
    """Return a shot whose samples of an end come later by a time."""
    samples, n = shot.samples.copy(), round(late / shot.dt)
    samples[end.row] = np.concatenate((np.full(n, shot.rest[end.row]), samples[end.row, :-n]))
    return dataclasses.replace(shot, samples=samples)


@pytest.mark.parametrize('name', [*rig.ROBUST_NAMES, 'nibble', 'stuck cell'])
def test_late_end_changes_no_content_read_by_waveforms(name):
    """One end alone may tell a level, and late it may look like another one. Sound records are
    decoded as what they are, which `record_shots` asserts.
    """
    element, contents = waveform_reader(name)
    for content, (shot, *rest) in zip(contents, record_shots(element, contents), strict=True):
        for late in (1.0, 2.0, 4.5, 8.5, 16.5, 24.5, 33.5, 56.0):
            for end in End:
                reading = element.reader.forecasts.decode(delay_end(shot, end, late), *rest)
                assert reading.level in (content, UNDECODABLE), (end, late)


@pytest.fixture(scope='module')
def element():
    """Return a calibrated element of four levels; its content is that of the last test."""
    given = rig.first_levels('robust_3_one_end', 4)
    made = draw_specimen(given.design, SCATTER, 1)
    element = MemoryElement(given, driver=Simulation.build_blank(made, given.settings.time))
    assert element.perform(Calibrate()).success
    return element


def test_left_end_writes_reads_and_erases_every_level(element):
    for level in np.random.default_rng(2).permutation(element.design.levels).tolist():
        assert element.perform(Write(level)).success
        assert rig.true_level(element, 1.5) == level
        # whatever the right end does, it counts as inactive and at rest
        assert np.ptp(element.transducer.recent[End.RIGHT.row]) == 0.0
        assert element.phase(End.RIGHT) == 0
        readings = [element.perform(Read()).reading for _ in range(3)]
        assert {each.content for each in readings} == {level}
        assert np.array_equal(element.reader.forecasts.parts, element.calibration.records)
        # records are of the same wall: a healthy read hardly differs from its record
        assert min(each.level_margin for each in readings) > 0.9
    assert element.perform(Erase()).success
    assert find_walls(element.design, element.chain.configuration) == []
    blank = element.perform(Read()).reading
    assert (blank.content, blank.code) == (BLANK, '')
    with expect_rejection(Refused, 'unsupported', 'read.method'):
        element.apply(Survey())


@pytest.mark.parametrize('site', [9, 20, 30])
@pytest.mark.parametrize('kind', ['stuck_cell', 'weak_cell'])
def test_cell_that_breaks_later_makes_no_read_wrong(element, site, kind):
    """A factor of no weak cell is no fault."""
    for level in (0, 1, 3):
        element.place_content(level)
        rig.set_faults(element, weak_factor=0.3, **{kind: site})
        for _ in range(100):  # a wall that it moves comes to rest
            element.advance()
        there = rig.true_level(element, 1.5)
        assert element.perform(Read()).reading.content in (there, UNDECODABLE)
        rig.set_faults(element)


def test_uncalibrated_element_asks_for_a_calibration_at_once():
    """A reset fires no pulse without records."""
    element = make_scattered('robust_3_one_end', 1)
    for command in (Read(), Write(2), Erase()):
        with expect_rejection(Refused, 'unsupported', 'read.method') as refused:
            element.apply(command)
        assert 'calibrate the element first' in str(refused.value)
    assert element.ticks == 0
    outcome = element.perform(Reset())
    assert outcome.reading.content == UNDECODABLE
    assert 'calibrate it first' in outcome.reading.reason
    assert np.abs(element.chain.velocity).max() < 1e-6
