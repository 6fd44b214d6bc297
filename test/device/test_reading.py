# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Decoding: a level, blank, or undecodable with a reason, never a guess."""

import dataclasses
import math
import re

import numpy as np
import pytest

from mlmem_ros.device import BLANK, UNDECODABLE, Calibration, DelayTable
from mlmem_ros.device.echo import Echo
from mlmem_ros.device.end import End
from mlmem_ros.device.reading import decode, phase_of
from mlmem_ros.device.settings import ProbeSettings, ReadSettings
from mlmem_ros.physics import CASE_II

CALIBRATION = Calibration(
    DelayTable(tuple(100.0 * (level + 1) for level in range(8))),
    DelayTable(tuple(500.0 - 50.0 * level for level in range(8)), blank=600.0),
)

STORED, EMPTY = (1, 0), (0, 0)
"""Phases of the left and right end with a wall between them, and of a blank element."""


def echo(delay, end=End.LEFT, margin=3.0):
    nothing = np.zeros(0)
    return Echo(end, ProbeSettings(), nothing, nothing, nothing, delay, margin)


def decoded(delay, end=End.LEFT, phases=STORED, right=CALIBRATION.right, **settings):
    calibration = dataclasses.replace(CALIBRATION, right=right)
    return decode(CASE_II, ReadSettings(**settings), calibration, echo(delay, end), phases)


@pytest.mark.parametrize('level', range(8))
@pytest.mark.parametrize('end', list(End))
def test_a_calibrated_delay_is_its_level(level, end):
    delay = 100.0 * (level + 1) if end == 'left' else 500.0 - 50.0 * level
    reading = decoded(delay, end)
    assert (reading.level, reading.code) == (level, f'{level:03b}')
    assert (reading.end, reading.delay, reading.reason) == (end, delay, '')
    assert (reading.level_margin, reading.threshold_margin) == (1.0, 3.0)
    site = 25 * (level + 1)
    assert reading.distance == pytest.approx(site - 1 if end == 'left' else 225 - site)


@pytest.mark.parametrize(
    ('delay', 'level', 'margin', 'distance'),
    [(120.0, 0, 0.6, 29.0), (180.0, 1, 0.6, 44.0), (239.0, 1, 0.22, 58.75), (70.0, 0, 0.4, 24.0)],
)
def test_a_delay_near_a_level_is_that_level_with_a_margin(delay, level, margin, distance):
    """25 cells are 100 time units here, so the distance goes with the delay: 24 + 0.25 x 20."""
    reading = decoded(delay)
    assert reading.level == level
    assert reading.level_margin == pytest.approx(margin)
    assert reading.distance == pytest.approx(distance)


@pytest.mark.parametrize('delay', [150.0, 159.0, 141.0, 55.0, 0.0, 845.0, 2000.0])
def test_a_delay_between_two_levels_is_undecodable(delay):
    """At 41 of 100 the margin is 0.18 < 0.2."""
    reading = decoded(delay)
    assert reading.level == UNDECODABLE
    assert 'lies between levels' in reading.reason
    assert f'{delay:.2f}' in reading.reason
    assert (reading.code, reading.delay, reading.distance) == ('', delay, math.inf)


def test_the_least_margin_is_a_setting():
    assert decoded(141.0, min_margin=0.15).level == 0
    assert decoded(120.0, min_margin=0.7).level == UNDECODABLE


def test_blank_is_an_answer():
    reading = decoded(595.0, End.RIGHT, EMPTY)
    assert (reading.level, reading.code, reading.reason) == (BLANK, '', '')
    assert reading.level_margin == pytest.approx(1.0 - 2.0 * 5.0 / 150.0)  # not level 0 beside it
    assert reading.distance == math.inf


def test_the_phase_of_the_left_end_distinguishes_equal_echoes():
    """Blank and level 0 are the farthest from the right: no wall is blank, no kink at level 0."""
    alike = dataclasses.replace(CALIBRATION.right, blank=503.0)
    for delay in (498.0, 502.0, 504.0):
        assert decoded(delay, End.RIGHT, STORED, right=alike).level == 0
        assert decoded(delay, End.RIGHT, EMPTY, right=alike).level == BLANK


@pytest.mark.parametrize(
    ('delay', 'end', 'phases', 'reason'),
    [
        (None, End.LEFT, STORED, 'no echo came back'),
        (None, End.RIGHT, EMPTY, 'no echo came back'),
        (1000.0, End.LEFT, (1, 1), 'the right end is active: the wall has left the element'),
        (300.0, End.LEFT, (1, 1), 'the left one hears a wall at level 2: there are two walls'),
        (None, End.RIGHT, (0, 1), 'the right end is active: the wall has left the element'),
        (300.0, End.LEFT, (None, 0), 'the left end rests in neither phase'),
        (300.0, End.LEFT, (1, None), 'the right end rests in neither phase'),
        (300.0, End.LEFT, EMPTY, 'the left end is inactive and hears nothing: probe the right'),
        (350.0, End.RIGHT, EMPTY, 'the left end is inactive, but .* is that of a wall at level 3'),
        (600.0, End.RIGHT, STORED, 'the delay 600.00 lies between levels'),
    ],
)
def test_inconsistent_observations_are_undecodable(delay, end, phases, reason):
    reading = decoded(delay, end, phases)
    assert reading.level == UNDECODABLE
    assert reading.level_margin == 0.0
    assert reading.distance == math.inf
    assert re.search(reason, reading.reason)


@pytest.mark.parametrize(
    ('share', 'phase'),
    [
        (-1.0, None), (-0.26, None), (-0.24, 0), (0.0, 0), (0.24, 0), (0.26, None),
        (0.5, None), (0.74, None), (0.76, 1), (1.0, 1), (1.24, 1), (1.26, None), (2.0, None),
    ],
)  # fmt: skip
def test_the_phase_of_an_end_follows_from_its_rest(share, phase):
    """A quarter of the way from a ground state to the next (-0.998 to 1.003) it counts."""
    assert phase_of(CASE_II, -0.99790 + share * 2.00076) == phase
