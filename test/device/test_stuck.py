# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A cell that no longer moves reflects pulses as a wall does: it must not be taken for one.

It answers from one side, and before the wall; so the ends do not agree. Every site of every design
is tried in the laboratory (`mlmem reads`).
"""

from dataclasses import replace

import pytest
from sampled import sampled

from mlmem import Faults, Read, SetFaults, Write, new_element, preset
from mlmem.physics import Specimen, find_level
from mlmem.physics.equilibrium import find_pinned_wall

NEAR = (-12, -4, -2, 2, 4, 12)
"""Places of the stuck cell, from the wall's defect."""


def four_levels(name):
    """Return a preset, of Case II its first four levels."""
    kind = preset(name)
    return kind._replace(design=replace(kind.design, N=min(kind.design.N, 125)))


def stuck(kind, level, cell):
    """Return an element whose wall rests at a level, and a cell of which then sticks."""
    element = new_element(kind)
    element.chain.place(find_pinned_wall(Specimen(element.design), level))
    element.transducer.assume_equilibrium()
    element.apply(SetFaults(Faults(stuck_cell=cell)))
    return element


def true_level(element):
    return find_level(element.design, element.chain.configuration)


@pytest.mark.parametrize('end', ['left', 'right'])
@pytest.mark.parametrize(
    ('name', 'level'),
    sampled(
        [('case_2', 0), ('case_2', 1), ('case_2', 3), ('bits_2', 0), ('bits_2', 3)],
        lambda each: each in (('case_2', 3), ('bits_2', 0)),
    ),
)
def test_no_read_names_another_level(name, level, end):
    kind = four_levels(name)
    design = kind.design
    for cell in (*(design.defect_site(level) + n for n in NEAR), 3, design.N - 2):
        if not 1 < cell < design.N:
            continue
        outcome = stuck(kind, level, cell).perform(Read(end))
        if outcome.success:
            assert outcome.reading.level == level, cell


@pytest.mark.parametrize(
    ('name', 'n'),
    sampled(
        [('case_2', -4), ('case_2', 4), ('bits_2', -4), ('bits_2', 4)],
        lambda each: each in (('case_2', -4), ('bits_2', 4)),
    ),
)
def test_no_write_is_acknowledged_that_was_not_done(name, n):
    """A wall that has to pass the cell, or may be taken for it."""
    kind = four_levels(name)
    element = stuck(kind, 1, kind.design.defect_site(2) + n)
    outcome = element.perform(Write(2))
    assert not outcome.success or true_level(element) == 2


def test_stuck_cell_goes_with_strain_of_write():
    """Nailed to the laboratory it was torn out of its well, and the device stopped. Now the write
    is refused or done, and the device goes on.
    """
    element = new_element(four_levels('case_2'))
    assert element.perform(Write(1)).success
    element.apply(SetFaults(Faults(stuck_cell=117)))
    before = element.chain.configuration[116]
    outcome = element.perform(Write(3))
    assert not outcome.success or true_level(element) == 3
    assert element.chain.configuration[116] == pytest.approx(before, abs=1e-9)
    element.perform(Read())
