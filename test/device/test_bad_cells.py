# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A bad cell that is known belongs to the forecast: what is left is used, the rest refused."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from rejection import expect_rejection
from sampled import sampled

from mlmem import (
    BLANK,
    UNDECODABLE,
    Calibrate,
    Erase,
    Faults,
    Locate,
    MemoryElement,
    Read,
    Refused,
    SelfTest,
    Settings,
    SettingsError,
    Survey,
    Write,
    element_file,
    load_element,
)
from mlmem.instrument.end import End
from mlmem.physics import Specimen
from mlmem.readers.bad_cells import list_wall_sets
from mlmem_tools import checks
from mlmem_tools.checks import Verdict

from . import rig

STUCK_CELL = 104
"""A cell beside the defect of level 3 of Case II, which is cell 100."""


def kind_with(name, cells, method='strain'):
    """Return a preset whose settings name bad cells; of Case II, whose first five levels."""
    design, settings = load_element(name).design_and_settings
    if name == 'case_2':
        design = replace(design, N=150)
    return design, rig.change(settings, write={'method': method}, element={'bad_cells': cells})


def element_with(name, cells, faults, method='strain'):
    """Return a blank element that is kind_with of some cells, with faults that may be others."""
    element = MemoryElement(*kind_with(name, cells, method))
    element.set_faults(faults)
    return element


def test_forecast_wall_sets_stay_within_reached_levels():
    """Behind a wall are two at most two levels apart, at most seven levels away."""
    everything = {
        *itertools.combinations(range(10), 1),
        *((first, first + apart) for first in range(10) for apart in (1, 2)),
        *(
            (first, low, low + apart)
            for first in range(10)
            for low in range(first + 1, first + 8)
            for apart in (1, 2)
        ),
    }
    for reached in (0, 3, 10):
        found = list(list_wall_sets(10, reached))
        assert len(found) == len(set(found))
        assert set(found) == {
            walls for walls in everything if len(walls) == 1 or walls[-1] < reached
        }


def place(element, *levels):
    """Put walls at rest at some levels, unknown to the element."""
    rig.pin(element, *levels)
    element.forget_content('placed')


def true_level(element):
    return rig.true_level(element, 0.5 * element.design.J)


def written(element, level):
    """Write a level (or erase) and read it; return what was acknowledged, read, and is so."""
    done = element.perform(Erase() if level == BLANK else Write(level))
    read = element.perform(Read())
    return done.success, read.success and read.reading.level, true_level(element)


@pytest.mark.parametrize('method', ['strain', 'kick'])
def test_stuck_cell_near_level_3_leaves_levels_before_it(method):
    """Up, down and blank, by strain and by kicks; without the forecast no read succeeds."""
    element = element_with('case_2', str(STUCK_CELL), Faults(stuck_cell=STUCK_CELL), method)
    assert element.reader.forecasts.usable == (0, 1, 2)
    for level in (2, 0, BLANK, 1):
        assert written(element, level) == (True, level, level)
    with pytest.raises(Refused, match='4 cannot be reached: cell 104 is stuck'):
        element.perform(Write(4))
    with pytest.raises(Refused, match='3 cannot be held: no wall rests there'):
        element.check_arguments(Write(3))
    assert true_level(element) == 1  # a refusal has changed nothing


def test_weak_cell_leaves_levels_reached_in_simulation():
    """Cell 31 holds a wall better than the defects of bits_2 beside it, so none gets past it."""
    element = element_with('bits_2', '31:0.5', Faults(weak_cell=31, weak_factor=0.5))
    assert element.reader.forecasts.usable == (0, 1)
    for level in (1, BLANK, 0):
        assert written(element, level) == (True, level, level)
    with pytest.raises(Refused, match=r'cannot be reached: cell 31 has 0\.5 of its'):
        element.perform(Write(3))
    place(element, 3)  # as no write can
    assert element.perform(Read()).reading.level == UNDECODABLE
    behind = element_with('bits_1', '62:0.5', Faults(weak_cell=62, weak_factor=0.5))
    assert behind.reader.forecasts.usable == (0, 1)
    place(behind, 1)
    assert behind.perform(Read()).reading.level == 1


@pytest.mark.parametrize(
    ('name', 'cells', 'faults'),
    sampled(
        [
            ('case_2', '104', Faults()),
            *(('case_2', '104', Faults(stuck_cell=cell)) for cell in (103, 106, 47, 135)),
            ('case_2', '104', Faults(weak_cell=104, weak_factor=0.2)),
            *(('case_2', '', Faults(stuck_cell=cell)) for cell in (31, 98, 104)),
            *(('bits_2', '', Faults(stuck_cell=cell)) for cell in (22, 31, 40)),
        ],
        lambda case: case[2].stuck_cell not in {22, 40, 47, 98, 103},
    ),
    ids=lambda each: str(each.list_active()) if isinstance(each, Faults) else None,
)
def test_wrong_knowledge_never_gives_wrong_level(name, cells, faults):
    """Told of a cell that is sound, of another one, or of none."""
    element, wrong = element_with(name, cells, faults), []
    for level in range(BLANK, element.design.levels):
        try:
            place(element, *([] if level == BLANK else [level]))
        except ValueError:  # no wall rests there
            continue
        for end in End:
            read = element.perform(Read(end))
            if read.success and read.reading.level != true_level(element):
                wrong.append((level, end, read.reading.level))
    assert wrong == []


@pytest.mark.parametrize(
    ('cell', 'placed', 'reason'),
    [
        # Two walls have the phases of a blank element, three those of one.
        (STUCK_CELL, [(0, 1), (1, 2), (0, 1, 2)], 'there are {} walls'),
        # The left end hears nothing of them: it read the element as blank.
        (62, [(2, 3), (3, 4), (2, 4), (0, 2, 3)],
         'nothing is known beyond cell 62: the right end hears 2 walls'),
    ],
)  # fmt: skip
def test_more_walls_are_not_taken_for_one_or_none(cell, placed, reason):
    element = element_with('case_2', str(cell), Faults(stuck_cell=cell))
    for walls in placed:
        place(element, *walls)
        read = element.perform(Read())
        assert (read.success, read.reading.level) == (False, UNDECODABLE)
        assert read.error == reason.format(len(walls))


@pytest.mark.parametrize(('name', 'site'), [('case_2', 104), ('case_2', 147), ('bits_2', 66)])
def test_locate_names_stuck_cell_of_blank_element(name, site):
    """To the right end cell 104 sounds like a wall at cell 111; the waveform tells which it is."""
    element = element_with(name, '', Faults(stuck_cell=site))
    assert element.perform(Locate()).found == {'walls': 0, 'stuck_cell': site}


def test_procedures_go_through_levels_that_are_left():
    element = element_with('bits_2', '31', Faults(stuck_cell=31))
    assert element.reader.forecasts.usable == (0, 1)
    assert written(element, 1) == (True, 1, 1)
    assert element.perform(Locate()).found == {
        'walls': 1, 'position': 18.0, 'position_std': pytest.approx(0.25)
    }  # fmt: skip
    tested = rig.succeed(element, SelfTest())
    tried = [each.name for each in tested.checks if each.name.startswith('level')]
    assert tried == ['level 0', 'level 1']
    calibrated = element.perform(Calibrate())
    assert (calibrated.success, calibrated.reading.level) == (True, 1)
    surveyed = element.perform(Survey())
    assert 'bad_cells must be empty' in surveyed.error


def test_design_check_names_levels_behind_a_stuck_cell(monkeypatch):
    design, settings = kind_with('case_2', '')
    element = element_file.Element(Specimen(design, stuck=(STUCK_CELL,)), np.zeros(design.N))
    monkeypatch.setattr(checks, 'CHECK_MODULES', (checks.launch,))  # all else takes a second
    finding = checks.check(design, settings, element)['bad_cells']
    assert (finding.verdict, finding.values['usable levels']) == (Verdict.WARN, 3.0)
    assert 'level 4 cannot be reached: cell 104 is stuck' in finding.text


def test_bad_cells_that_are_none_or_leave_no_level_are_rejected():
    for cells in ('1', '61:', '61:0', '61:nan', 'half'):
        with expect_rejection(SettingsError, 'out_of_range', 'bad_cells'):
            kind_with('case_2', cells)
    for name, cells, code, field in (
        ('case_2', '225', 'conflict', 'bad_cells'),
        ('case_2', '5', 'unsupported', 'element.bad_cells'),
        ('byte', '104', 'conflict', 'element.bad_cells'),
    ):
        with expect_rejection(SettingsError, code, field):
            MemoryElement(*kind_with(name, cells, 'kick'))
    assert Settings().add_stuck_cells((3, 7)).element.stuck_sites == (3, 7)
