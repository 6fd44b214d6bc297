# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The delay table: what makes a valid one, the nearest entry, and how clear the choice is; and the
procedure that measures it.
"""

import dataclasses
import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sampled import sampled

from mlmem import (
    BLANK,
    UNDECODABLE,
    Calibrate,
    Calibration,
    DelayTable,
    Read,
    SettingsError,
    Write,
)
from mlmem.instrument.end import End
from mlmem.move_settings import WriteSettings
from mlmem.parsing import decode_value
from mlmem.procedures import calibrating
from mlmem.settings import ReadSettings

from . import rig

ONCE = WriteSettings(attempts=1)

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
    assert decode_value(DelayTable, json.loads(json.dumps(table.as_dict()))) == table


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
        (None, 'it must be an object; got nothing'),
        ({'delays': [], 'blank': None}, '^delays must be finite, one for every level'),
    ],
    ids=str,
)
def test_data_that_are_not_a_table_are_refused(data, message):
    with pytest.raises(ValueError, match=message):
        decode_value(DelayTable, data)


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


# --- the procedure ----------------------------------------------------------------------------


@pytest.mark.parametrize('level', [None, 3])
def test_a_calibration_is_close_to_the_factorys_and_restores_the_content(written, level):
    element = rig.device() if level is None else written(level)
    factory = element.calibration
    outcome = rig.run(element, Calibrate())
    assert outcome.success, outcome.error
    assert outcome.reading.level == (BLANK if level is None else level)
    assert rig.holds(element, level)
    assert element.calibration != factory
    for end in End:
        known, new = factory.table(end).delays, element.calibration.table(end).delays
        # a wall that came by strain still creeps by a tenth of a cell; levels are 25 apart
        np.testing.assert_allclose(new, known, atol=0.1 * np.abs(np.diff(known)).max())
    assert element.calibration.right.blank == pytest.approx(factory.right.blank, abs=5.0)
    assert rig.succeed(element, Write(2)).level_margin > 0.9  # and it can be used
    assert rig.holds(element, 2)


def test_a_calibration_that_fails_restores_the_content(written, monkeypatch):
    """The wall does not follow to level 2, while it is calibrated."""
    element, go_to_level = written(1), calibrating.go_to_level
    known = element.calibration

    def lame(element, place, level, *force, **how):
        yield from go_to_level(element, place, place if level == 2 else level, *force, **how)

    monkeypatch.setattr(calibrating, 'go_to_level', lame)
    outcome = rig.run(element, Calibrate())
    assert not outcome.success
    assert outcome.error == (
        'the calibration was not taken: on the way to level 2 the left end hears level 1, at '
        f'{outcome.error.rpartition(" ")[2]}'
    )
    assert outcome.reading.level == 1
    assert rig.holds(element, 1)
    assert element.calibration is known


@pytest.mark.parametrize('names', sampled(('left', 'right'), lambda end: end == 'right'))
def test_a_table_that_is_off_by_a_level_is_noticed(written, names):
    """By a read, since the other end does not agree, and by a calibration at its first level."""
    element = written(1, read=ReadSettings(end=names), write=ONCE)
    known = element.calibration.left.delays
    off = DelayTable((2.0 * known[0] - known[1], *known[:-1]))
    element.calibration = wrong = dataclasses.replace(element.calibration, left=off)
    assert rig.run(element, Read()).reading.level == UNDECODABLE
    outcome = rig.run(element, Calibrate())
    assert outcome.error.startswith(
        'the calibration was not taken: on the way to level 0 the left end hears level 1, at '
    )
    assert element.calibration is wrong


@pytest.mark.parametrize(
    ('peaks', 'level'), [({'tension': 0.005}, 2), ({'compression': -0.005}, 1)]
)
def test_a_wall_that_does_not_follow_gives_no_calibration(peaks, level):
    """The first step with the weak peak fails: the table would be off by one level."""
    element = rig.device(1, **rig.with_group('write', **peaks))
    factory = element.calibration
    outcome = rig.run(element, Calibrate())
    assert not outcome.success
    assert f'on the way to level {level} the left end hears level {level - 1}' in outcome.error
    assert element.calibration is factory


@pytest.mark.parametrize('names', sampled(('left', 'right'), lambda end: end == 'right'))
def test_an_end_without_echoes_gives_no_calibration(written, names):
    """The left one's threshold is a cell: no level is confirmed."""
    deaf = rig.with_group('probe', v_th=1.0)
    element = written(1, read=ReadSettings(end=names), write=ONCE, **deaf)
    factory = element.calibration
    outcome = rig.run(element, Calibrate())
    assert 'level 0 gives no echo at the left end' in outcome.error
    assert element.calibration is factory
