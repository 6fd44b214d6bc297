# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Shifts: half a cycle of strain moves by a level every wall whose turn it is."""

from dataclasses import replace

import pytest

from mlmem_ros.device import BLANK, Read, Refused, Reset, Shift, Write, new_element, preset
from mlmem_ros.device.register import resting
from mlmem_ros.physics import Specimen

from . import rig


def holding(name, *levels):
    """Return an element with walls at rest at levels, whose content is not known."""
    element = new_element(preset(name))
    element.chain.place(resting(Specimen(element.design), levels))
    element.transducer.assume_rest()
    return element


def test_the_half_that_frees_a_wall_takes_it_up_a_level_and_the_other_leaves_it():
    element = holding('case_2', 2)
    for half, level in (('tension', 2), ('compression', 3), ('compression', 3), ('tension', 4)):
        assert rig.succeed(element, Shift(half)).level == level
    assert element.perform(Read()).reading.level == 4


def test_without_a_half_it_is_that_which_frees_the_wall():
    element = holding('case_2', 0)
    halves = [element.perform(Shift()).found['half'] for _ in range(2)]
    assert halves == ['compression', 'tension']
    assert element.reading.level == 2


@pytest.mark.parametrize(
    ('half', 'moved'), [('compression', 0b0100100), ('', 0b0100100), ('tension', 0b0010010)]
)
def test_walls_and_kinks_that_take_turns_keep_step(half, moved):
    """A wall at level 4 and a kink at level 1 are freed by compression, by tension neither."""
    assert rig.succeed(holding('byte', 1, 4), Shift(half)).level == moved


def test_walls_that_annihilate_are_no_shift():
    """Compression drives the wall at 2 into the kink at 3."""
    element = holding('byte', 2, 3, 5)
    rig.succeed(element, Read())
    outcome = rig.run(element, Shift())
    assert not outcome.success
    assert outcome.error.startswith(
        'a compression was to take the walls from levels [2, 3, 5] to [3, 4, 5], not to [5]: '
    )
    assert outcome.reading.level == 0b100000


def test_a_wall_that_still_swings_is_heard_again():
    """Soon after the strain it answers 1.29 times as loud as a wall at level 8 does at rest."""
    assert rig.succeed(holding('bits_4', 7), Shift()).level == 8


def test_a_blank_element_stays_blank():
    assert rig.succeed(new_element(preset('case_2')), Shift()).level == BLANK


def test_a_wall_that_leaves_is_not_read_as_another_content():
    outcome = rig.run(holding('case_2', 7), Shift())
    assert not outcome.success
    assert 'after a tension what it holds cannot be read' in outcome.error


def test_without_an_actuator_it_is_refused_and_changes_nothing():
    design, settings = preset('kick_2')
    absent = replace(settings.actuator, present=False)
    element = new_element(design, replace(settings, actuator=absent))
    with pytest.raises(Refused, match=r'a shift needs an actuator, .* \(actuator.present\)'):
        element.apply(Shift())
    assert element.procedure == ''


def test_it_takes_about_as_long_as_expected_and_wears_one_cycle():
    element = holding('case_2', 0)
    rig.succeed(element, Read())
    cycles, shares = element.statistics.cycles, []
    outcome = element.perform(Shift(), lambda: shares.append(element.feedback().share))
    assert element.statistics.cycles == cycles + 1
    assert shares[-1] > 0.8
    assert outcome.attempts == 1


def test_a_fresh_byte_holds_the_word_0():
    element = holding('byte', 1, 4)
    assert rig.succeed(element, Reset()).level == 0
    assert rig.succeed(element, Write(0xA7)).level == 0xA7
