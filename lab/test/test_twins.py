# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What fits and twins are worth, counted in small, and what is kept of it."""

import argparse
import json
from copy import deepcopy
from functools import cache

import numpy as np
import pytest

from mlmem import preset
from mlmem.physics import HeldCell, Specimen
from mlmem_lab.rk4 import Rk4Element
from mlmem_lab.twins import command, surveyed, watched
from mlmem_lab.twins.command import Part, twins
from mlmem_lab.twins.sensed import HiddenElement
from mlmem_tools.rig.emulated import Sensors


def mlmem_twins(*arguments):
    parser = argparse.ArgumentParser()
    for add in twins.options:
        add(parser)
    return twins.run(parser.parse_args([str(each) for each in arguments]))


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


def test_a_hidden_element_differs_from_its_design_in_everything_shared():
    design = preset('bits_1').design
    found = surveyed.make_hidden_element(design, 0.01, 3)
    for name in ('d', 'a', 'eta', 's_max', 'j_0'):
        own = getattr(found.specimen.design, name)
        assert own != getattr(design, name)
        assert own == pytest.approx(getattr(design, name), rel=0.03)
    assert np.std(found.specimen.alpha_factor) == pytest.approx(0.01, rel=0.3)
    assert found.time_unit != 1.0


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


@pytest.fixture
def quick(monkeypatch):
    """Rows that take no time."""
    part = Part(row_of, lambda rows: {'elements': len(rows)}, ('elements',), ('bits_1',))
    monkeypatch.setitem(command.STUDY_PARTS, 'healthy', part)


def row_of(preset, scatter, seed):
    return {'seed': seed}


def test_the_command_keeps_what_the_file_has_of_others(tmp_path, capsys, quick):
    path = tmp_path / 'twin.json'
    for scatter in ('0.01', '0.003', '0.01'):
        arguments = 'healthy', '--scatter', scatter, '--elements', 2, '--workers', 1
        assert mlmem_twins(*arguments, '--output', path) == 0
    kept = json.loads(path.read_text())
    assert [entry['scatter'] for entry in kept['healthy']] == [0.01, 0.003]
    assert kept['healthy'][0] == {
        'preset': 'bits_1', 'scatter': 0.01, 'seed': 0, 'elements': 2,
        'rows': [{'seed': 0}, {'seed': 1}],
    }  # fmt: skip
    assert list(kept['hashes']) == ['healthy bits_1 0.01', 'healthy bits_1 0.003']
    assert 'bits_1' in capsys.readouterr().out


COUNTED: list[int] = []


def counted_row_of(preset, scatter, seed):
    COUNTED.append(seed)
    return row_of(preset, scatter, seed)


def test_a_count_goes_on_where_it_was_stopped(tmp_path, monkeypatch, quick):
    path, part = tmp_path / 'twin.json', command.STUDY_PARTS['healthy']
    monkeypatch.setitem(command.STUDY_PARTS, 'healthy', part._replace(one=counted_row_of))
    COUNTED.clear()
    for elements in (1, 3):
        arguments = 'healthy', '--elements', elements, '--workers', 1, '--output', path
        assert mlmem_twins(*arguments) == 0
    assert COUNTED == [0, 1, 2]
    [entry] = json.loads(path.read_text())['healthy']
    assert entry['elements'] == 3


def test_the_commands_of_a_file_make_all_its_entries_again():
    """Kinds and presets that are counted alike share one."""
    entries = [
        {'preset': preset, 'scatter': 0.01, 'kind': kind, 'elements': elements, 'seed': 7}
        for preset, elements in (('bits_1', 2), ('bits_4', 2), ('case_2', 1))
        for kind in ('alpha', 'damping 20 %')
    ]
    changes = [{'preset': 'bits_4', 'scatter': 0.01, 'change': c, 'elements': 4, 'seed': 0}
               for c in ('a', 'b')]  # fmt: skip
    alike = "--kinds alpha 'damping 20 %'"
    assert command.join_commands({'fits': entries, 'changes': changes}, 'twin.json').split(
        ' && '
    ) == [
        f'mlmem twins {words} --output lab/results/twin.json'
        for words in (
            f'fits --presets bits_1 bits_4 --scatter 0.01 {alike} --elements 2 --seed 7',
            f'fits --presets case_2 --scatter 0.01 {alike} --elements 1 --seed 7',
            'changes --presets bits_4 --scatter 0.01 --elements 4 --seed 0',
        )
    ]


@pytest.mark.parametrize(
    ('wrong', 'said'),
    [
        (['twins'], 'a part must be one of fits, healthy, changes; got twins'),
        (['--presets', 'bits_7'], 'got bits_7'),
        (['--kinds', 'beta'], 'a kind must be one of alpha, of mlmem rig, springs'),
        (['--elements', '0'], '--elements and --workers must be at least 1'),
        (['--scatter', '0'], '--scatter must be above 0'),
    ],
)
def test_misuse_is_named(wrong, said, capsys):
    assert mlmem_twins(*wrong) == 2
    assert said in capsys.readouterr().err


def test_a_result_that_cannot_be_read_is_left_as_it_is(tmp_path, capsys, quick):
    path = tmp_path / 'twin.json'
    path.write_text('{"healthy": ')
    assert mlmem_twins('healthy', '--elements', 1, '--workers', 1, '--output', path) == 1
    assert 'the result could not be written' in capsys.readouterr().err
    assert path.read_text() == '{"healthy": '
