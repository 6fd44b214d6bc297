# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reads from both ends: one wall, two, three or none, on the real material and by hand."""

import dataclasses
import math

import numpy as np
import pytest

from mlmem_ros.device import BLANK, UNDECODABLE, Heard, Read, Reading, Write
from mlmem_ros.device.reading import combine
from mlmem_ros.device.settings import ReadSettings
from mlmem_ros.physics import CASE_II, Specimen, walls
from mlmem_ros.physics.equilibrium import relax

from . import rig


def with_walls(*defects, first_active=True):
    """Return a device at rest whose phase changes at these defects."""
    design = CASE_II
    step = design.D_s2 - design.D_s1
    v = np.full(design.N, design.D_s2 if first_active else design.D_s1)
    for count, defect in enumerate(defects):
        down = (count % 2 == 0) == first_active
        rise = 0.5 * (1.0 + np.tanh((design.sites - defect - 0.3) / 3.0))
        v += (-step if down else step) * rise
    element = rig.device()
    element.chain.place(relax(Specimen(design), v, np.zeros(design.N)))
    element.transducer.settle()
    found = [wall.position for wall in walls(design, element.chain.configuration)]
    assert found == pytest.approx(defects, abs=1.0), 'it does not rest there'
    return element


@pytest.mark.parametrize('level', range(8))
def test_one_wall_is_the_same_from_both_ends(written, level):
    element = written(level)
    told = rig.events(element, Read('both'))
    left, right = (event for event in told if isinstance(event, Heard))
    assert (left.echo.end, left.reading.end) == ('left', 'left')
    assert (right.echo.end, right.reading.end) == ('right', 'both')
    reading = told[-1].reading
    assert reading == right.reading == element.reading
    assert (reading.level, reading.code, reading.walls) == (level, f'{level:03b}', 1)
    assert (reading.delay, reading.right_delay) == (left.echo.delay, right.echo.delay)
    assert reading.threshold_margin == min(left.echo.threshold_margin, right.echo.threshold_margin)
    assert reading.level_margin > 0.7
    # the walls' distances are told by levels 25 cells apart, as well as the margin is near 1
    assert 1.0 + reading.distance == pytest.approx(rig.wall(element), abs=0.15 * 25)
    assert rig.holds(element, level)


@pytest.mark.parametrize('defects', [(25, 75, 125), (50, 100, 175), (25, 50, 75), (100, 150, 200)])
def test_three_walls_are_detected_only_from_both_ends(defects):
    """Active, inactive, active, inactive: the ends rest as those of a stored level do."""
    first, last = defects[0] // 25 - 1, defects[-1] // 25 - 1
    element = with_walls(*defects)
    assert rig.succeed(element, Read('left')).level == first
    assert rig.succeed(element, Read('right')).level == last
    assert element.reading.walls is None, 'one end cannot tell'
    outcome = rig.run(element, Read('both'))
    assert outcome.error == (
        f'the left end hears a wall at level {first} and the right end one at level {last}: '
        'there are three walls, or more'
    )
    assert (outcome.reading.level, outcome.reading.walls) == (UNDECODABLE, 3)
    assert outcome.reading.confidence == 0.0


@pytest.mark.parametrize('end', ['left', 'both', ''])
@pytest.mark.parametrize('defects', [(50, 100), (25, 200), (25, 50)])
def test_an_active_stretch_within_an_inactive_element_is_two_walls(defects, end):
    """Heard from the right alone, for the left carrier does not pass the inactive phase."""
    outcome = rig.run(with_walls(*defects, first_active=False), Read(end))
    assert not outcome.success
    if end == 'left':
        assert outcome.error == 'the left end is inactive and hears nothing: probe the right'
        return
    assert outcome.reading.walls == 2
    assert f'a wall at level {defects[1] // 25 - 1}: there are two walls' in outcome.error


@pytest.mark.parametrize('end', ['left', 'both', ''])
@pytest.mark.parametrize('defects', [(75, 150), (175, 200)])
def test_an_inactive_stretch_within_an_active_element_is_two_walls(defects, end):
    outcome = rig.run(with_walls(*defects), Read(end))
    assert not outcome.success
    assert outcome.reading.walls == 2
    assert f'a wall at level {defects[0] // 25 - 1}: there are two walls' in outcome.error


@pytest.mark.parametrize('end', ['left', 'both', ''])
def test_an_element_all_active_has_no_wall(end):
    outcome = rig.run(with_walls(), Read(end))
    assert outcome.error == 'the right end is active: the wall has left the element'
    assert outcome.reading.walls == 0


def test_a_blank_element_has_no_wall():
    reading = rig.succeed(rig.device(), Read('both'))
    assert (reading.level, reading.end, reading.walls) == (BLANK, 'right', 0)


def test_a_write_is_verified_from_the_ends_that_a_read_probes(written):
    """So a wall that is hidden from the left end by another one is not missed."""
    element = written(2, read=ReadSettings(end='both'))
    reading = rig.succeed(element, Write(4))
    assert (reading.level, reading.end, reading.walls) == (4, 'both', 1)
    assert rig.holds(element, 4)


# --- what both say together, by hand ----------------------------------------------------------


def said(level, end, distance, **values):
    margins = {'level_margin': 0.9, 'threshold_margin': 4.0, **values}
    return Reading(level, f'{level:03b}', end, 300.0, distance=distance, **margins)


def together(left, right, **settings):
    return combine(CASE_II, ReadSettings(**settings), left, right)


def test_the_lesser_margin_counts():
    """Level 3, at 100 of 225: 99 cells from the left, 125 from the right, 224 in all."""
    left = said(3, 'left', 99.0, level_margin=0.8)
    right = dataclasses.replace(said(3, 'right', 125.0, threshold_margin=2.5), delay=350.0)
    both = together(left, right)
    assert (both.level, both.end, both.walls, both.reason) == (3, 'both', 1, '')
    assert (both.level_margin, both.threshold_margin, both.confidence) == (0.8, 2.5, 0.6)
    assert (both.delay, both.right_delay, both.distance) == (300.0, 350.0, 99.0)


@pytest.mark.parametrize('off', [-9.0, -5.0, 5.0, 9.0])
def test_distances_that_do_not_add_up_lower_the_margin(off):
    """Half the spacing of levels is 12.5 cells, where the margin is zero."""
    both = together(said(3, 'left', 99.0), said(3, 'right', 125.0 + off))
    assert both.level == 3
    assert both.level_margin == pytest.approx(1.0 - abs(off) / 12.5)


@pytest.mark.parametrize('off', [-11.0, 11.0])
def test_distances_that_do_not_fit_one_wall_are_undecodable(off):
    """At 11 cells the margin is 0.12, less than 0.2."""
    both = together(said(3, 'left', 99.0), said(3, 'right', 125.0 + off))
    assert both.level == UNDECODABLE
    assert 'the ends do not hear the same wall' in both.reason
    assert f'{224 + off:.1f} of 224 in all' in both.reason
    assert both.distance == math.inf
    assert (
        together(said(3, 'left', 99.0), said(3, 'right', 125.0 + off), min_margin=0.1).walls == 1
    )


def test_impossible_levels_are_undecodable():
    """The first wall from the left cannot lie beyond the first from the right."""
    both = together(said(4, 'left', 124.0), said(3, 'right', 125.0))
    assert (both.level, both.walls) == (UNDECODABLE, None)
    assert 'the ends do not hear the same wall: level 4' in both.reason


def test_the_reasons_of_both_ends_are_reported():
    left = dataclasses.replace(said(UNDECODABLE, 'left', math.inf), reason='no echo came back')
    both = together(left, said(3, 'right', 125.0))
    assert both.level == UNDECODABLE
    assert both.reason == 'left: no echo came back; right: level 3'


# --- confidence -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ('level_margin', 'threshold_margin', 'confidence'),
    [
        (1.0, 4.0, 0.75),  # three quarters of the echo may be lost
        (0.3, 4.0, 0.3),  # the delay may shift by 0.3 of the way to half-way
        (1.0, 2.0, 0.5),
        (1.0, 1.0, 0.0),
        (0.9, 0.5, 0.0),
        (-0.1, 4.0, 0.0),
    ],
)
def test_confidence_is_the_loss_that_leaves_the_answer_unchanged(
    level_margin, threshold_margin, confidence
):
    reading = said(3, 'left', 99.0, level_margin=level_margin, threshold_margin=threshold_margin)
    assert reading.confidence == pytest.approx(confidence)


def test_confidence_is_zero_if_nothing_is_decoded():
    assert said(UNDECODABLE, 'left', math.inf).confidence == 0.0


@pytest.mark.parametrize('level', [0, 4, 7])
def test_an_echo_that_fades_by_less_than_the_confidence_is_still_heard(written, level):
    """Raising the threshold by a factor f equals an echo fainter by 1 / f."""
    element = written(level)
    reading = rig.succeed(element, Read('right'))
    share = 1.0 - 1.0 / reading.threshold_margin
    for lost, heard in ((share - 0.02, True), (share + 0.02, False)):
        v_th = 7e-4 / (1.0 - lost)
        faint = written(level, **rig.with_group('probe_right', v_th=v_th))
        faint.calibration = element.calibration
        assert (rig.run(faint, Read('right')).reading.delay is not None) == heard
