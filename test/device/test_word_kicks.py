# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A register without clearing pulse: kicks put walls in and take them out."""

from dataclasses import replace

import pytest

from mlmem import Erase, MemoryElement, Write, load_element
from mlmem.errors import SettingsError
from mlmem.instrument.drivers import Simulation
from mlmem.moves.planner import erasing_moves, find_route
from mlmem.physics import Scatter, Specimen, scattered
from mlmem.physics.equilibrium import find_pinned_walls
from mlmem.readers.reading import UNDECODABLE
from mlmem.readers.register import find_wall_levels
from mlmem.readers.words import Code
from mlmem.settings import ElementSettings

from . import rig

SHIPPED = load_element('robust_words')
DESIGN, SETTINGS = SHIPPED.design, SHIPPED.settings
CODE = Code(8, 3)


def walls_of(element):
    return find_wall_levels(element.design, element.chain.configuration)


@pytest.mark.parametrize('scatter', [0.0, 0.02])
def test_words_follow_each_other_in_scattered_elements(scatter):
    """Three walls, two of others, one, none: every write takes walls out and puts others in."""
    made = scattered(DESIGN, Scatter(alpha=scatter, k_r=scatter, mass=scatter), 77)
    element = MemoryElement(DESIGN, SETTINGS, driver=Simulation.of(made, SETTINGS.time))
    for walls in ((1, 4, 7), (0, 6), (3,), (2, 5)):
        assert element.perform(Write(CODE.word(walls))).success
        assert walls_of(element) == walls
    assert element.perform(Erase()).success
    assert walls_of(element) == ()


def test_erase_of_an_unknown_content_succeeds():
    """A wall pinned by the lattice next to a kink is no word."""
    between = find_pinned_walls(
        Specimen(DESIGN), [DESIGN.defect_site(level) + 0.3 for level in (2, 4)]
    )
    assert find_wall_levels(DESIGN, between) == (2, 4)
    element = rig.settle(MemoryElement(DESIGN, SETTINGS), between)
    assert element.perform(Erase()).success
    assert walls_of(element) == ()


def test_kicks_out_have_the_speeds_of_kinks_and_walls_in_turn():
    """Three walls rest: a kink goes to the level below the first, a wall below the second."""
    element, speeds = rig.pin(MemoryElement(DESIGN, SETTINGS), 1, 4, 7), []
    kick = element.transducer.kick
    element.transducer.kick = lambda target, speed: speeds.append(speed) or kick(target, speed)
    assert element.perform(Write(CODE.word((3,)))).success
    of_kinks, of_walls = SETTINGS.kick.kink_speeds, SETTINGS.kick.wall_speeds
    assert speeds[0] / of_kinks[0] == pytest.approx(speeds[1] / of_walls[3])
    assert speeds[0] < of_kinks[0]  # they stop short of what they are to meet


def test_route_keeps_walls_that_rest_already():
    """Only walls to the left are missing: nothing is taken out."""
    start, target = CODE.word((7,)), CODE.word((1, 4, 7))
    assert [move.name for move in find_route(DESIGN, SETTINGS, start, target)] == ['kick'] * 2


def test_kicks_clear_only_without_a_clearing_pulse():
    assert [move.name for move in erasing_moves(DESIGN, SETTINGS)] == ['kick out']
    byte = load_element('byte')
    moves = erasing_moves(byte.design, byte.settings)
    assert [move.name for move in moves] == ['clearing pulse']
    assert all(move.start == UNDECODABLE for move in moves)


def test_waveform_method_needs_no_bad_cells():
    one_wall = replace(SETTINGS.register, spacing=0)
    with pytest.raises(SettingsError) as caught:
        replace(SETTINGS, register=one_wall, element=ElementSettings('40'))
    assert caught.value.field == 'read.method'
