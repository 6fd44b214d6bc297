# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What fits and twins are worth, counted in small, and what is kept of it."""

from copy import deepcopy
from functools import cache
from types import SimpleNamespace

import pytest

from mlmem.errors import ProcedureFailed
from mlmem_lab.twins import surveyed, watched
from mlmem_lab.twins.study import watch_elements

calibrated = cache(watched.WatchedElement)


@pytest.fixture
def calibrated_once(monkeypatch):
    """An element is made, planned and calibrated once, and every test has a copy."""
    monkeypatch.setattr(watched, 'WatchedElement', lambda *which: deepcopy(calibrated(*which)))


def test_healthy_element_is_read_and_nothing_is_told(calibrated_once):
    found = watched.watch_healthy('bits_1', 0.01, 2, reads=5)
    assert found['reads'] == 4  # not that of the write, whose waves are still about
    assert found['alarms'] == 0


@pytest.mark.parametrize('change', ['a cell 8 % weaker', 'left gain - 5 %'])
def test_change_is_told_with_its_name_and_amount(change, calibrated_once):
    found = watched.watch_changed('bits_1', 0.01, 2, change)
    assert (found['alarm'], found['named']) == (False, True)
    assert found['reads'] == 2
    assert found['off'] < 0.2


def test_element_that_cannot_be_calibrated_is_not_watched(monkeypatch):
    failed = SimpleNamespace(success=False, error='no wall')
    monkeypatch.setattr(watched, 'load_forecast', lambda *_: None)
    monkeypatch.setattr(watched, 'perform_command', lambda *_: (failed, []))
    with pytest.raises(ProcedureFailed, match='seed 7: no wall'):
        watched.WatchedElement('bits_1', 0.01, 7)


def test_elements_that_fail_are_counted_beside_those_watched():
    def watch(seed):
        if seed == 2:
            raise ProcedureFailed('seed 2: no wall')
        return {'seed': seed}

    rows, failed = watch_elements(watch, range(1, 4))
    assert [row['seed'] for row in rows] == [1, 3]
    assert failed == ['seed 2: no wall']


def test_false_alarms_and_changes_not_told_are_counted():
    row = {'seed': 1, 'site': 4, 'wall': 9.0, 'text': '', 'named': False, 'reads': None}
    told = row | {'text': 'cell 4 ...', 'named': True, 'reads': 2, 'off': 0.1, 'alarm': True}
    found = watched.summarise_changed([row | {'off': None, 'alarm': False}, told])
    assert [found[name] for name in ('told', 'named', 'alarms', 'reads')] == [1, 1, 1, 2.0]
    assert found['off'] == pytest.approx(10.0)
    assert found['silent'] == [{'seed': 1, 'site': 4, 'wall': 9.0}]


def test_fit_that_lies_is_counted():
    """Whose error is beyond three times what it states; refusals are kept with their reason."""
    row = {
        'seed': 1, 'shots': 9, 'chi2': 1.0, 'in band': 1.1, 'added': [],
        'inside': 0.9, 'error': 1e-3, 'stated': 9e-4,
    }  # fmt: skip
    lying = row | {'error': 3e-3, 'added': ['latency', 'springs']}
    found = surveyed.summarise_fits([row, lying, {'seed': 3, 'refused': 'why'}])
    assert [found[name] for name in ('elements', 'fitted', 'lies')] == [3, 2, 1]
    assert found['added'] == {'nothing': 1, 'latency, springs': 1}
    assert found['refused'] == ['why']
