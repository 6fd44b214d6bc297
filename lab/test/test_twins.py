# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What fits and twins are worth, counted in small, and what is kept of it."""

from copy import deepcopy
from functools import cache

import numpy as np
import pytest

from mlmem import preset
from mlmem.physics import HeldCell, Specimen
from mlmem_lab.rk4 import Rk4Element
from mlmem_lab.twins import surveyed, watched
from mlmem_lab.twins.sensed import HiddenElement
from mlmem_lab.twins.study import STUDY, add_entry, name_case
from mlmem_tools.rig.emulated import Sensors

calibrated = cache(watched.Bench)


@pytest.fixture
def calibrated_once(monkeypatch):
    """An element is made, planned and calibrated once, and every test has a copy."""
    monkeypatch.setattr(watched, 'Bench', lambda *which: deepcopy(calibrated(*which)))


def test_a_healthy_element_is_read_and_nothing_is_told(monkeypatch, calibrated_once):
    monkeypatch.setattr(watched, 'HEALTHY_READS', 5)
    found = watched.watch_healthy('bits_1', 0.01, 1)
    assert found['reads'] == 4  # not that of the write, whose waves are still about
    assert found['alarms'] == 0


@pytest.mark.parametrize('change', ['a cell 8 % weaker', 'left gain - 5 %'])
def test_a_change_is_told_with_its_name_and_amount(change, calibrated_once):
    found = watched.watch_changed('bits_1', 0.01, 1, change)
    assert (found['alarm'], found['named']) == (False, True)
    assert found['reads'] == 2
    assert found['off'] < 0.2


def test_false_alarms_and_changes_not_told_are_counted():
    row = {'seed': 1, 'site': 4, 'wall': 9.0, 'text': '', 'named': False, 'reads': None}
    told = row | {'text': 'cell 4 ...', 'named': True, 'reads': 2, 'off': 0.1, 'alarm': True}
    found = watched.summarise_changed([row | {'off': None, 'alarm': False}, told])
    assert [found[name] for name in ('told', 'named', 'alarms', 'reads')] == [1, 1, 1, 2.0]
    assert found['off'] == pytest.approx(10.0)
    assert found['silent'] == [{'seed': 1, 'site': 4, 'wall': 9.0}]


@pytest.mark.slow
@pytest.mark.parametrize('seed', [0, 19])
def test_a_surveyed_element_is_found(seed):
    """In the second the wall stays at its first place: its minimum takes 20 iterations."""
    found = surveyed.survey_element('bits_1', 0.01, seed)
    assert found['chi2'] == pytest.approx(1.0, abs=0.05)
    assert found['error'] < 5e-4  # a twentieth of the scatter
    assert found['inside'] > 0.6  # errors are common to all cells of an element


def test_a_fit_that_lies_is_counted():
    """Whose error is beyond three times what it states; refusals are kept with their reason."""
    row = {
        'seed': 1, 'shots': 9, 'time': 1.0, 'seconds': 2.0, 'chi2': 1.0, 'in band': 1.1,
        'added': [], 'inside': 0.9, 'error': 1e-3, 'stated': 9e-4,
    }  # fmt: skip
    lying = row | {'error': 3e-3, 'added': ['latency', 'springs'], 'inside own': 0.5}
    found = surveyed.summarise_fits([row, lying, {'seed': 3, 'refused': 'why'}])
    assert [found[name] for name in ('elements', 'fitted', 'lies')] == [3, 2, 1]
    assert found['added'] == {'nothing': 1, 'latency, springs': 1}
    assert found['refused'] == ['why']
    assert found['inside own'] == 50.0


@pytest.mark.parametrize('late', [(0, 0), (3, 1)])
def test_a_hidden_element_is_heard_as_late_as_its_line_is(late):
    """A cell that swings at 1 per time unit, through the samples of the end that is held."""
    element = Rk4Element(Specimen(preset('bits_1').design), 0.0625)
    driver = HiddenElement(element, Sensors(), late)
    times = 0.0625 * np.arange(1, 4 * 400 + 1)
    motion = np.stack((np.sin(times) ** 3, 3.0 * np.sin(times) ** 2 * np.cos(times))) * 0.01
    motion[0] += element.end(1)
    heard = driver.advance(np.zeros(len(times)), HeldCell(1, motion))[0]
    expected = np.interp(0.25 * np.arange(1, 401) - 0.0625 * late[0], times, motion[0])
    assert heard == pytest.approx(expected, abs=1e-12)


def test_entries_of_a_part_are_in_the_order_of_the_cases():
    first, later = STUDY.cases[0], STUDY.cases[3]
    kept: dict = {}
    for case in (later, first, later):
        _, preset_name, kind = case.split(', ', 2)
        entry = {'preset': preset_name, 'kind': kind, 'rows': []}
        kept = add_entry(kept, case, entry)
    assert [name_case('fits', entry) for entry in kept['fits']] == [first, later]
    assert kept['healthy'] == kept['changes'] == []
