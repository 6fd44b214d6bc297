# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The delay table: what makes a valid one, the nearest entry, and how clear the choice is."""

import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mlmem_ros.device import Calibration, DelayTable, SettingsError
from mlmem_ros.device.end import End
from mlmem_ros.outside import decode

from . import rig

RISING = DelayTable((100.0, 200.0, 320.0, 400.0))
FALLING = DelayTable((400.0, 320.0, 200.0, 100.0), blank=500.0)
SHAPED = DelayTable((100.0, 200.0), shapes=((95.0, 107.5, 4.2), (190.0, None, 1.2)))


@pytest.mark.parametrize(
    ('delays', 'message'),
    [
        ((), 'finite, one for every level; got []'),
        ((1.0, math.nan), 'finite'),
        ((math.inf,), 'finite'),
    ],
)
def test_a_table_of_no_delays_is_refused(delays, message):
    with pytest.raises(SettingsError, match=message.replace('[]', r'\[\]')):
        DelayTable(delays)


@pytest.mark.parametrize('delays', [(1.0, 2.0, 2.0), (1.0, 3.0, 2.0)])
def test_the_end_that_names_the_level_must_tell_all_apart(delays):
    """The other end only confirms it: two levels near it may have the same delay."""
    alike, message = DelayTable(delays), f'rise or fall from level to level.*got {list(delays)}'
    message = message.replace('[', r'\[').replace(']', r'\]')
    apart = DelayTable((1.0, 2.0, 3.0))
    with pytest.raises(ValueError, match=message):
        alike.check()
    Calibration(alike, apart).check(3, End.RIGHT)
    Calibration(apart, alike).check(3, End.LEFT)
    Calibration(alike, alike).check(3)
    for tables, first in (((alike, apart), End.LEFT), ((apart, alike), End.RIGHT)):
        with pytest.raises(ValueError, match=message):
            Calibration(*tables).check(3, first)


@pytest.mark.parametrize('blank', [math.nan, math.inf, 200.0])
def test_a_blank_delay_equal_to_a_level_is_refused(blank):
    """But for level 0, which the phase of the left end tells from it."""
    message = 'blank must be a finite delay that no level but 0 has'
    with pytest.raises(ValueError, match=message):
        DelayTable(RISING.delays, blank)
    assert DelayTable(FALLING.delays, blank=400.0).nearest(400.0, -1) == (0, 1.0)
    assert DelayTable(FALLING.delays, blank=400.0).nearest(400.0, 0) == (-1, 1.0)


@pytest.mark.parametrize('table', [RISING, FALLING])
def test_the_margin_is_1_on_every_entry(table):
    for level, delay in enumerate(table.delays):
        assert table.nearest(delay) == (level, 1.0)
    if table.blank is not None:
        assert table.nearest(table.blank) == (-1, 1.0)


@pytest.mark.parametrize(
    ('delay', 'level', 'margin'),
    [
        (149.999, 0, 0.0),  # half-way
        (150.001, 1, 0.0),
        (125.0, 0, 0.5),  # a quarter of the way
        (260.001, 2, 0.0),
        (230.0, 1, 0.5),  # 30 of 120: the spacing on the side where it lies counts
        (180.0, 1, 0.6),  # 20 of 100
        (380.0, 3, 0.5),  # 20 of 80
        (50.0, 0, 0.0),  # beyond the end the nearest spacing is the measure
        (0.0, 0, -1.0),
        (440.0, 3, 0.0),
        (480.0, 3, -1.0),
    ],
)
def test_the_margin_falls_to_0_half_way_to_the_neighbour(delay, level, margin):
    found, clear = RISING.nearest(delay)
    assert found == level
    assert clear == pytest.approx(margin, abs=1e-4)  # the delays are 0.001 off half-way


def test_blank_is_an_entry_like_the_others():
    assert FALLING.nearest(460.0) == (-1, pytest.approx(0.2))
    assert FALLING.nearest(440.0) == (0, pytest.approx(0.2))
    assert FALLING.nearest(560.0) == (-1, pytest.approx(-0.2))  # 60 off, half the spacing is 50


def test_a_single_level_is_judged_by_its_own_delay():
    table = DelayTable((200.0,))
    assert table.nearest(200.0) == (0, 1.0)
    assert table.nearest(250.0) == (0, 0.5)
    assert table.nearest(350.0) == (0, -0.5)


@rig.unhurried
@given(
    st.lists(st.floats(1.0, 5000.0), min_size=1, max_size=9, unique=True),
    st.booleans(),
    st.floats(0.0, 6000.0),
)
def test_the_nearest_entry_is_the_nearest(delays, falling, delay):
    delays = sorted(delays, reverse=falling)
    level, margin = DelayTable(tuple(delays)).nearest(delay)
    assert abs(delays[level] - delay) == min(abs(entry - delay) for entry in delays)
    assert margin <= 1.0
    if min(delays) <= delay <= max(delays):
        assert margin >= -1e-9


@pytest.mark.parametrize(
    ('delay', 'level', 'margin'),
    [
        (200.0, 1, 1.0),
        (225.0, 1, 0.5),  # the spacings about it are 100, 120 and 80: a quarter of 100
        (250.0, 2, -0.4),  # a level that it is not
        (100.0, 3, -5.0),
    ],
)
def test_a_level_is_agreed_with_by_the_median_spacing_about_it(delay, level, margin):
    offset = delay - RISING.delays[level]
    assert RISING.margin(level, offset, 0.0) == pytest.approx(margin)


def test_a_level_is_agreed_with_within_the_spacing_of_the_fastest_waves():
    """Where delays are nearly the same, and for an element of one level."""
    alike = DelayTable((100.0, 101.0))
    assert alike.margin(0, 1.0, 80.0) == pytest.approx(1.0 - 2.0 / 80.0)
    assert DelayTable((100.0,)).margin(0, 20.0, 80.0) == pytest.approx(0.5)


@pytest.mark.parametrize('table', [RISING, FALLING])
def test_the_distance_is_interpolated_between_the_levels(table):
    distances = [10.0, 30.0, 50.0, 70.0] if table is RISING else [70.0, 50.0, 30.0, 10.0]
    assert table.distance(200.0, distances) == 30.0
    assert table.distance(230.0, distances) == pytest.approx(35.0)  # a quarter of 120
    assert table.distance(0.0, distances) == 10.0
    assert table.distance(900.0, distances) == 70.0


@pytest.mark.parametrize('table', [RISING, FALLING, SHAPED])
def test_a_table_survives_a_file(table):
    assert decode(DelayTable, json.loads(json.dumps(table.as_dict()))) == table


@pytest.mark.parametrize(
    ('data', 'message'),
    [
        ({}, 'it lacks delays'),
        ({'delays': 7, 'blank': None}, 'delays must be a list; got 7'),
        ({'delays': ['x'], 'blank': None}, r"delays\[0\] must be a finite number; got 'x'"),
        ({'delays': [1.0], 'blank': []}, r'blank must be a finite number; got \[\]'),
        ({'delays': [1.0], 'blank': None, 'shapes': [[1.0, 2.0, 0.0]]}, 'louder than 0'),
        ({'delays': [1.0], 'blank': None, 'shapes': [[1.0]]}, r'shapes\[0\] must be a list of 3'),
        (
            {'delays': [1.0], 'blank': None, 'shapes': [[1.0, math.nan, 2.0]]},
            r'\[0\]\[1\] must be',
        ),
        (
            {'delays': [1.0], 'blank': None, 'shapes': [[1, 2, 3], [3, 4, 5]]},
            'must be 1, .*; got 2',
        ),
        (None, 'it must be an object; got None'),
        ({'delays': [], 'blank': None}, '^delays must be finite, one for every level'),
    ],
    ids=str,
)
def test_data_that_are_not_a_table_are_refused(data, message):
    with pytest.raises(ValueError, match=message):
        decode(DelayTable, data)


def test_a_calibration_has_a_table_for_each_end():
    calibration = Calibration(RISING, FALLING)
    assert calibration.table(End.LEFT) is RISING
    assert calibration.table(End.RIGHT) is FALLING
    calibration.check(4)
    for other in (3, 5):
        with pytest.raises(SettingsError, match=f'must have {other} levels, like the design'):
            calibration.check(other)
    with pytest.raises(SettingsError, match='must have 4 levels, like the design; got 1'):
        Calibration(RISING, DelayTable((1.0,))).check(4)
