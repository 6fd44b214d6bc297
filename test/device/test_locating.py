# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where the wall is, as measured and as it is; and the pulses of a survey."""

import dataclasses

import numpy as np
import pytest
from rejection import expect_rejection

from mlmem import BLANK, UNDECODABLE, Disturb, End, Locate, Read, Refused, Shot, Survey, Write
from mlmem.instrument.echo import Echo
from mlmem.physics import CASE_II
from mlmem.physics.equilibrium import find_pinned_walls
from mlmem.procedures import writing
from mlmem.readers.delay_reader import locate_reflector
from mlmem.readers.reading import WELL_ERROR_CELLS

from . import rig


@pytest.mark.parametrize(
    ('name', 'near'),
    [
        *(('case_2', near) for near in (25, 60, 65, 80, 90, 110, 200)),  # levels are 25 apart
        ('bits_1', 10),  # the left end begins to listen when its echo is there: one end alone
        ('bits_1', 14),  # nothing is known between its two levels
        ('case_1', 100),  # its only level is located by the group velocity
        ('bits_4', 100),  # the right end names the level, and a cell is three time units
    ],
)
def test_wall_is_located_at_levels_and_between_them(name, near):
    element = rig.shipped(name)
    rig.settle(element, find_pinned_walls(element.design, [near + 0.3]))
    found = rig.succeed(element, Locate()).found
    assert found['walls'] == 1
    assert name != 'case_2' or found['position_std'] < 0.5
    # three standard deviations
    assert found['position'] == pytest.approx(rig.wall(element), abs=3.0 * found['position_std'])


@pytest.mark.parametrize(
    ('positions', 'walls'),
    [((50, 100, 175), 3), ((50, 100), 2), ((25, 75, 300), 2), ((300,), None)],
)
def test_walls_other_than_one_are_neither_read_nor_located(positions, walls):
    """An end that answers late, or a bad cell, sounds like more walls; one at 300 has left."""
    element = rig.settle(rig.device(design=CASE_II), find_pinned_walls(CASE_II, positions))
    for end in ('left', 'right', 'both'):
        read = element.perform(Read(end))
        assert (read.success, read.reading.level) == (False, UNDECODABLE)
        assert walls is None or read.reading.walls == walls
    outcome = element.perform(Locate())
    assert (outcome.success, outcome.found) == (False, {})
    assert outcome.error


@pytest.mark.parametrize(
    ('name', 'level', 'end', 'delay'),
    [
        ('kick_4', BLANK, 'both', 15.8),
        ('case_2', 3, 'left', 25.0),
        ('case_2', 3, 'both', 25.0),
        ('bits_4', BLANK, 'right', 25.0),
        ('bits_4', 6, 'left', 15.8),
        ('kick_2', 3, 'left', 20.0),
    ],
)
def test_late_sensors_locate_no_wall_that_is_not_there(name, level, end, delay):
    element = rig.shipped(name)
    element.place_content(level)
    rig.set_faults(element, sensor_delay=delay, sensor_end=end)
    element.transducer.assume_equilibrium()
    outcome = element.perform(Locate())
    assert (outcome.success, outcome.found) == (False, {})
    assert outcome.error


@pytest.mark.parametrize('step', [0.5, 3.0])
@pytest.mark.parametrize('floor', [0.0, 2e-3])
def test_error_of_position_grows_with_samples_and_noise(step, floor):
    """Levels whose delays rise evenly, so that no error is that of the lines between them: a cell
    takes 4 time units. The envelope rises by 1e-3 in a time unit.
    """
    design = dataclasses.replace(CASE_II, N=150)
    delays = tuple(100.0 + 4.0 * site for site in map(design.defect_site, range(design.levels)))
    element = rig.device(design=design)
    left = dataclasses.replace(element.calibration.left, delays=delays)
    element.calibration = dataclasses.replace(element.calibration, left=left)
    t, site = step * np.arange(1.0, 400.0), design.defect_site(2)
    v_c = 1e-3 * np.abs(t - 50.0)
    probe = element.transducer.probes[End.LEFT]
    echo = Echo(End.LEFT, probe, t, v_c, v_c, delays[2], threshold_margin=2.0, floor=floor)
    position, deviation = locate_reflector(element, echo)
    timing = np.hypot(step, floor / 1e-3)
    assert position == pytest.approx(site)
    assert deviation == pytest.approx(np.hypot(WELL_ERROR_CELLS, timing / 4.0))


def test_locating_moves_nothing_and_leaves_content_to_read(written):
    """A shaken wall is not located."""
    blank, element = written(BLANK), written(3)
    assert rig.succeed(blank, Locate()).found == {'walls': 0}
    assert blank.reading.level == BLANK
    before = rig.wall(element)
    rig.succeed(element, Locate())
    assert rig.wall(element) == pytest.approx(before, abs=0.05)  # it still rings a little
    assert rig.succeed(element, Read()).reading.level == 3
    element.apply(Disturb(1e-4))
    shaken = element.perform(Locate())
    assert (shaken.success, shaken.found) == (False, {})


def survey(element):
    """Survey an element, which must succeed; return the outcome and its shots."""
    *events, outcome = rig.events(element, Survey())
    assert outcome.success, outcome.error
    shots = [event for event in events if isinstance(event, Shot)]
    assert outcome.found == {'shots': len(shots)}
    return outcome, shots


def test_survey_pulses_every_state_and_restores_content():
    """A shot begins at rest, and lasts for 900 time units."""
    element = rig.shipped('bits_1')
    rig.succeed(element, Write(1))
    outcome, shots = survey(element)
    assert outcome.reading.level == rig.true_level(element) == 1
    walls = {shot.wall for shot in shots}
    assert walls == {0, 9, 18}  # blank, launched, the last of two levels
    for wall in walls:
        assert {shot.end for shot in shots if shot.wall == wall} == set(End)
    assert {shot.strain for shot in shots} == {0.0, -0.009, 0.009}
    for shot in shots:
        assert shot.samples.shape[1] * shot.dt >= 900.0 + shot.pulse.duration
        assert np.isfinite(shot.samples).all()
        driven = shot.samples[shot.end.row] - shot.rest[shot.end.row]
        assert np.abs(driven).max() == pytest.approx(shot.A, rel=0.2)
        still = shot.samples[shot.end.opposite.row, :4] - shot.rest[shot.end.opposite.row]
        # A third of a threshold of 9e-4 is quiet, of which exp(-5) is left: 2e-6 of carriers;
        # with waves of other frequencies, up to 3.1e-6 was seen. The pulse has 1e-2.
        assert np.abs(still).max() < 5e-6


def test_survey_without_actuator_goes_half_way_where_wall_is_lost(monkeypatch):
    """The wall is gone after the kick to the middle level, 2; so that to level 1 is tried."""
    element, go_to_level = rig.shipped('kick_2', actuator={'present': False}), writing.go_to_level
    rig.succeed(element, Write(3))

    def lose_wall(element, present, level, *force, **how):
        yield from go_to_level(element, present, BLANK if level == 2 else level, *force, **how)

    monkeypatch.setattr(writing, 'go_to_level', lose_wall)
    _, shots = survey(element)
    assert rig.true_level(element) == 3
    assert element.chain.V_N == 0.0
    assert len(shots) == 4 + 2 + 3
    assert {shot.strain for shot in shots} == {0.0}
    assert {shot.wall for shot in shots} == {0, *map(element.design.defect_site, (0, 1))}


def test_survey_without_moves_or_damping_is_rejected():
    element = rig.shipped('kick_2', actuator={'present': False}, transducer={'max_speed': 0.001})
    with expect_rejection(Refused, 'unsupported'):
        element.perform(Survey())
    element = rig.shipped('bits_1')
    element.design = dataclasses.replace(element.design, eta=0.0)
    assert 'needs damping' in element.perform(Survey()).error


def test_samples_after_interruption_are_not_there():
    element = rig.shipped('bits_1')
    recorder = element.transducer.record_pulse(End.LEFT, element.transducer.probes[End.LEFT])
    element.pass_ticks(2)
    element.driver.interrupted = True
    element.pass_ticks(1)
    element.driver.interrupted = False
    element.pass_ticks(1)
    per_tick = element.steps_per_tick
    samples = recorder.shot(0.0, 0.0, element.driver.dt).samples
    assert np.isfinite(samples[:, : 2 * per_tick]).all()
    assert np.isnan(samples[:, 2 * per_tick :]).all()
