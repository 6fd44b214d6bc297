# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The fastest route from level to level, and that walls take it."""

import itertools
import sys

import pytest

import mlmem.moves
from mlmem import PRESETS, Write, new_element, preset
from mlmem.moves.move import blank_content
from mlmem.moves.planner import disable_kicks, find_moves, find_route, move_families
from mlmem.physics import CASE_II
from mlmem.readers.reading import BLANK
from mlmem.settings import Settings


def ways(design, settings, start, target):
    return [move.name for move in find_route(design, settings, start, target)]


@pytest.mark.parametrize('name', PRESETS)
def test_every_place_can_be_reached(name):
    design, settings = preset(name)
    places = [blank_content(settings), 0, design.levels // 2, design.levels - 1]
    for start, target in itertools.permutations(set(places), 2):
        way = find_route(design, settings, start, target)
        assert [move.start for move in way] == [start, *(move.target for move in way[:-1])]
        assert way[-1].target == target


def test_no_route_is_longer_than_move_and_route_from_there():
    design, settings = preset('bits_4')

    def time(way):
        return sum(move.duration for move in way)

    for start, target in ((15, 14), (14, 13), (15, 7), (3, 2), (BLANK, 5)):
        shortest = time(find_route(design, settings, start, target))
        for move in find_moves(design, settings, start):
            rest = time(find_route(design, settings, move.target, target))
            assert shortest <= move.duration + rest


def test_papers_route_has_only_steps_up_and_kink():
    design, settings = preset('bits_4')
    assert ways(design, settings, 2, 5) == ['step up'] * 3
    assert ways(design, settings, 4, 4) == []
    assert ways(design, disable_kicks(settings), 3, 2) == ['erase', 'launch', *['step up'] * 2]
    assert ways(CASE_II, Settings(), 1, 0) == ['erase', 'launch']


def test_route_of_register_adds_walls_or_clears_first():
    design, settings = preset('byte')  # with a spacing of 1 the levels are the bits
    added = ways(design, settings, 0b1000_0000, 0b1100_0001)
    assert added == ['kick'] * 2
    cleared = ways(design, settings, 0b1000_0001, 0b1100_0000)
    assert cleared == ['clearing pulse', *['kick'] * 2]


MADE_UP = """
from dataclasses import dataclass

from mlmem.physics.equilibrium import find_pinned_wall


@dataclass(frozen=True)
class Lift:
    start: int
    target: int

    name = 'lift'
    duration = 40.0
    ringing = 0.0
    margin = 0.5
    needs_actuator = False
    listens = False

    def drive(self, element, how):
        element.begin_cycle('lifted')
        element.chain.place(find_pinned_wall(element.chain.specimen, self.target))
        element.transducer.assume_equilibrium()
        yield 2


def moves_from(design, settings, start, target):
    if start != -1 and target > start:
        yield Lift(start, target)
"""


@pytest.fixture
def lift(tmp_path, monkeypatch):
    """Add a file to the package of moves, and nothing else."""
    (tmp_path / 'lift.py').write_text(MADE_UP)
    monkeypatch.setattr(mlmem.moves, '__path__', [*mlmem.moves.__path__, str(tmp_path)])
    move_families.cache_clear()
    yield
    move_families.cache_clear()
    sys.modules.pop('mlmem.moves.lift', None)


@pytest.mark.usefixtures('lift')
def test_move_in_own_file_is_planned_and_driven():
    design, settings = preset('case_2')
    assert ways(design, settings, 1, 6) == ['lift']
    assert ways(design, settings, BLANK, 2) == ['launch', 'lift']
    element = new_element(design, settings)
    assert element.perform(Write(1)).success
    lifted = element.perform(Write(6))
    assert lifted.success, lifted.error
    assert lifted.attempts == 1
    assert lifted.reading.level == 6
