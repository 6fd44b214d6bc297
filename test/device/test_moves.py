# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The fastest route from level to level, and that walls take it."""

import dataclasses
import itertools

import pytest
from sampled import sampled

from mlmem_ros.device import PRESETS, preset
from mlmem_ros.device.move_settings import StrokeSettings
from mlmem_ros.device.moves import (
    How,
    cycle_of,
    moves_from,
    paper_way,
    route,
    stroke_peak,
    throw_cycle,
)
from mlmem_ros.device.reading import BLANK
from mlmem_ros.device.settings import Settings, SettingsError
from mlmem_ros.physics import CASE_II
from mlmem_tools.checks.bare import moved

GOING_BACK = sampled(
    [
        name
        for name, (design, settings) in PRESETS.items()
        if name != 'bits_3' and (settings.down_odd.peak or settings.throw.peak)  # it is case_2
    ],
    lambda name: PRESETS[name].design.levels <= 16,
)


def ways(design, settings, start, target):
    return [move.how for move in route(design, settings, start, target)]


@pytest.mark.parametrize('name', PRESETS)
def test_every_place_can_be_reached(name):
    design, settings = preset(name)
    places = [BLANK, 0, design.levels // 2, design.levels - 1]
    for start, target in itertools.permutations(set(places), 2):
        way = route(design, settings, start, target)
        assert [move.start for move in way] == [start, *(move.target for move in way[:-1])]
        assert way[-1].target == target


def test_no_route_is_longer_than_a_move_and_the_route_from_there():
    design, settings = preset('bits_4')

    def time(way):
        return sum(move.time for move in way)

    for start, target in ((15, 14), (14, 13), (15, 7), (3, 2), (BLANK, 5)):
        shortest = time(route(design, settings, start, target))
        for move in moves_from(design, settings, start):
            rest = time(route(design, settings, move.target, target))
            assert shortest <= move.time + rest


def test_a_route_upward_is_one_step_per_level():
    design, settings = preset('bits_4')
    assert ways(design, settings, 2, 5) == [How.STEP] * 3
    assert ways(design, settings, 4, 4) == []


def test_strokes_up_skip_levels_and_a_stroke_down_returns_one():
    design, settings = preset('case_2')
    assert [move.target for move in route(design, settings, 0, 7)] == [1, 3, 5, 7]
    assert [move.target for move in route(design, settings, 0, 6)] == [1, 3, 5, 7, 6]


def test_one_level_down_is_a_stroke_and_many_are_a_throw():
    design, settings = preset('bits_4')
    assert ways(design, settings, 15, 14) == [How.STROKE]
    assert ways(design, settings, 15, 1) == [How.THROW, How.LAUNCH, How.STEP]


def test_the_papers_route_has_only_steps_up_and_a_kink():
    design, settings = preset('bits_4')
    assert ways(design, paper_way(settings), 3, 2) == [How.ERASE, How.LAUNCH, *[How.STEP] * 2]
    assert ways(CASE_II, Settings(), 1, 0) == [How.ERASE, How.LAUNCH]


def test_a_stroke_is_stronger_at_a_nearer_site():
    design, settings = preset('bits_4')
    far, near = (stroke_peak(design, settings.down_odd, level) for level in (15, 7))
    assert near == pytest.approx(far * 2.0**settings.down_odd.growth)


def strokes(settings, start):
    return [move.target for move in moves_from(CASE_II, settings, start) if move.how is How.STROKE]


def test_strokes_begin_at_their_lowest_level_and_end_at_existing_levels():
    two = StrokeSettings(peak=0.01, levels=2, lowest=2)
    settings = dataclasses.replace(Settings(), down_odd=two, up_odd=two)
    found = {start: strokes(settings, start) for start in (1, 2, 3, 7)}
    assert found == {1: [], 2: [], 3: [5, 1], 7: [5]}


def test_a_move_is_not_used_from_levels_that_are_barred():
    """Without its throw a write erases, which listens; a stroke is left out."""
    design, settings = preset('case_2')
    assert ways(design, settings, 7, 0) == [How.ERASE, How.LAUNCH]
    plain = dataclasses.replace(settings, throw=dataclasses.replace(settings.throw, not_from=''))
    assert ways(design, plain, 7, 0) == [How.THROW, How.LAUNCH]
    barred = dataclasses.replace(settings.down_odd, not_from='3 7')
    settings = dataclasses.replace(settings, down_odd=barred)
    assert [strokes(settings, start) for start in (3, 5, 7)] == [[5], [7, 4], []]


@pytest.mark.parametrize('text', ['1, 7', '-1', '1.5', 'all', '9' * 6])
def test_barred_levels_are_whole_numbers(text):
    with pytest.raises(SettingsError, match=r'not_from must be levels separated by spaces'):
        StrokeSettings(not_from=text)


def test_a_peak_beyond_the_actuator_is_refused():
    with pytest.raises(SettingsError, match=r'throw.peak must be within actuator.max_strain'):
        dataclasses.replace(preset('case_2').settings, throw=preset_throw(0.2))


def preset_throw(peak):
    return dataclasses.replace(preset('case_2').settings.throw, peak=peak)


@pytest.mark.parametrize('name', GOING_BACK)
def test_every_stroke_and_every_throw_of_the_presets_ends_where_it_should(name):
    """From every level of up to 16, from every third of more."""
    design, settings = preset(name)
    for level in range(0, design.levels, 1 if design.levels <= 16 else 3):
        for move in moves_from(design, settings, level):
            if move.how in (How.STROKE, How.THROW):
                after = moved(design, cycle_of(design, settings, move), level, dt=1.0)
                assert after == move.target


def test_a_throw_leaves_a_blank_element_blank():
    design, settings = preset('bits_4')
    assert [moved(design, throw_cycle(settings, pulse), BLANK) for pulse in (0, 1)] == [BLANK] * 2
