# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The fastest route from level to level, and that walls take it."""

import itertools

import pytest

from mlmem import PRESETS, preset
from mlmem.moves.planner import How, disable_kicks, find_moves, find_route
from mlmem.physics import CASE_II
from mlmem.readers.reading import BLANK
from mlmem.settings import Settings


def ways(design, settings, start, target):
    return [move.how for move in find_route(design, settings, start, target)]


@pytest.mark.parametrize('name', PRESETS)
def test_every_place_can_be_reached(name):
    design, settings = preset(name)
    places = [BLANK, 0, design.levels // 2, design.levels - 1]
    for start, target in itertools.permutations(set(places), 2):
        way = find_route(design, settings, start, target)
        assert [move.start for move in way] == [start, *(move.target for move in way[:-1])]
        assert way[-1].target == target


def test_no_route_is_longer_than_a_move_and_the_route_from_there():
    design, settings = preset('bits_4')

    def time(way):
        return sum(move.time for move in way)

    for start, target in ((15, 14), (14, 13), (15, 7), (3, 2), (BLANK, 5)):
        shortest = time(find_route(design, settings, start, target))
        for move in find_moves(design, settings, start):
            rest = time(find_route(design, settings, move.target, target))
            assert shortest <= move.time + rest


def test_a_route_upward_is_one_step_per_level():
    design, settings = preset('bits_4')
    assert ways(design, settings, 2, 5) == [How.STEP] * 3
    assert ways(design, settings, 4, 4) == []


def test_the_papers_route_has_only_steps_up_and_a_kink():
    design, settings = preset('bits_4')
    assert ways(design, disable_kicks(settings), 3, 2) == [How.ERASE, How.LAUNCH, *[How.STEP] * 2]
    assert ways(CASE_II, Settings(), 1, 0) == [How.ERASE, How.LAUNCH]
