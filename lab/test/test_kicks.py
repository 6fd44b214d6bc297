# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The committed kicks are those of the code, and no counted write is wrong."""

import json
from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import pytest

from mlmem import MemoryElement, factory_calibration, preset
from mlmem.instrument.blocks import run
from mlmem.instrument.drivers import Simulation
from mlmem.moves.kick import kick_out
from mlmem.moves.move import MIN_MARGIN
from mlmem.physics import (
    Specimen,
    find_level,
)
from mlmem.physics.equilibrium import find_pinned_wall
from mlmem.readers.reading import BLANK
from mlmem_lab.results import RESULT_FOLDER, load_result
from mlmem_lab.rk4 import Rk4Element
from mlmem_lab.windows import flight
from mlmem_lab.windows.command import windows
from mlmem_lab.windows.flight import (
    after_erase,
    after_kick,
    build_chain,
    erase_margins,
    kick_margins,
    search_kicks,
)
from mlmem_lab.windows.kicks import STUDY, count_writes
from mlmem_lab.windows.words import cases_ahead, kicked_behind

MAPPED = load_result(STUDY.path)['presets']


def chain_of(name):
    design, settings = preset(name)
    return build_chain(Specimen(design), settings)


@pytest.mark.parametrize('name', STUDY.cases)
def test_the_committed_map_is_that_of_the_code(name):
    design, settings = preset(name)
    chain = chain_of(name)
    for k in range(20, 320, 60):
        found = after_kick(chain, MAPPED[name]['speeds'][k], settings.kick)
        assert found == MAPPED[name]['ends'][k]
    assert after_erase(chain, design.levels - 1, settings.kick) == BLANK


@pytest.mark.parametrize('name', STUDY.cases)
def test_every_shipped_move_bears_a_tenth_in_every_quantity_but_the_stroke_of_a_kick(name):
    """What bears less is barred. Of the stroke, see the next test."""
    design, settings = preset(name)
    chain = chain_of(name)
    for level, speed in enumerate(settings.kick.wall_speeds):
        for factor in (1.1, 1.0 / 1.1):
            assert after_kick(chain, factor * speed, settings.kick) == level
        found = MAPPED[name]['levels'][level]
        assert found['room'] >= MIN_MARGIN
        assert settings.kick.room(level) <= found['room'] + 0.005  # as it says itself
        assert min(found['rooms'][each] for each in ('hold', 'late')) >= MIN_MARGIN
    for each in MAPPED[name]['erases']:
        assert min(each[quantity] for quantity in ('speed', 'hold', 'late')) >= MIN_MARGIN
    for off in (-0.1, 0.1):
        for level in (0, 1, design.levels - 1):
            assert after_erase(chain, level, settings.kick, 'speed', off) == BLANK


@pytest.mark.parametrize('off', [-0.2, 0.2])
def test_another_integrator_agrees_that_a_kick_erases(off):
    """The device over classical Runge-Kutta steps, with a kick a fifth too slow or too fast."""
    design, settings = preset('kick_4')
    speed = (1.0 + off) * settings.kick.erase_speed
    settings = replace(settings, kick=replace(settings.kick, erase_speed=speed))
    known = factory_calibration(design, settings)
    made, dt = Specimen(design), MemoryElement(design, settings, known).driver.dt
    for level in (0, 1, 15):
        body = Rk4Element(made, dt, step=0.125)
        body.v[:] = find_pinned_wall(made, level)
        element = MemoryElement(design, settings, known, body)
        element.transducer.assume_equilibrium()
        run(element, kick_out(element))
        assert find_level(design, body.v) == BLANK


def test_the_stroke_must_be_right_within_a_hundredth(monkeypatch):
    """A wall has the energy 0.49, and levels of case_2 differ by 0.003 to 0.1 in what a kick adds:
    one per cent of the stroke is as much.
    """
    settings = preset('case_2').settings
    monkeypatch.setattr(flight, 'KICK_QUANTITIES', ('gain', 'speed'))
    rooms = kick_margins(chain_of('case_2'), 3, settings.kick)
    assert 0.01 < rooms['gain'] < 0.03
    assert rooms['speed'] > 0.15


@pytest.mark.parametrize('name', STUDY.cases)
def test_no_write_of_the_committed_count_was_wrong(name):
    written = MAPPED[name]['written']
    assert written['writes'] + written['erases'] >= 1000
    assert written['wrong'] == written['failed'] == 0
    assert written['strained'] <= 0.1 * written['writes']


def test_a_search_finds_kicks_as_wide_as_those_that_ship():
    settings = preset('kick_2').settings
    found = search_kicks(chain_of('kick_2'), settings.kick, settings.transducer.max_speed)
    for level, each in enumerate(found):
        assert each.room >= settings.kick.room(level)
        assert after_kick(chain_of('kick_2'), each.speed, settings.kick) == level


def test_a_search_takes_no_wall_that_was_turned_back(monkeypatch):
    """Level 7 of Case II is reached by speeds of 0.21 to 0.32, and of 0.58 to 1.1 once more."""
    monkeypatch.setattr(flight, 'KICK_SPEEDS', flight.KICK_SPEEDS[::4])
    monkeypatch.setattr(flight, 'EDGE_TOLERANCE', 0.05)
    settings = preset('case_2').settings
    assert 0.2 < search_kicks(chain_of('case_2'), settings.kick)[7].speed < 0.35


def test_writes_are_counted_and_none_strains_the_element():
    found = count_writes('kick_2', 12, seed=1)
    assert (found['writes'], found['erases']) == (11, 1)
    assert (found['wrong'], found['failed'], found['strained']) == (0, 0, 0)


def windows_of(*presets):
    return windows.run(SimpleNamespace(presets=list(presets), element=None, jobs=1, json=True))


def test_the_windows_of_an_element_file_name_the_kick_that_fails(tmp_path, capsys, monkeypatch):
    """Its last kick is a fifth too slow. Kicks that erase are off by up to a twentieth."""
    erases = partial(erase_margins, farthest=0.05)
    monkeypatch.setattr('mlmem_lab.windows.command.erase_margins', erases)
    file = tmp_path / 'slow.yaml'
    file.write_text(
        'format: 1\nbased_on: kick_2\nkick:\n  speeds: [0.0031, 0.0103, 0.0222, 0.0294]\n'
        '  rooms: [0.5, 0.05, 0.3, 0.2]\n'
    )
    assert windows_of(str(file)) == 1
    found = json.loads(capsys.readouterr().out)[str(file)]
    assert [each['how'] for each in found] == ['kick'] * 4 + ['kick out'] * 4
    assert [each['used'] for each in found[:4]] == [True, False, True, True]
    assert [level for level, each in enumerate(found) if not any(each['rooms'].values())] == [3]
    known = MAPPED['kick_2']['levels']
    assert [each['rooms'] for each in found[:3]] == [each['rooms'] for each in known[:3]]


def test_windows_of_an_unknown_preset_are_refused(capsys):
    assert windows_of('bits_7') == 2
    assert "got 'bits_7'" in capsys.readouterr().err


# --- the committed windows of a register's kicks ---------------------------------------------


@pytest.mark.parametrize('number', [2, 9, 12])
def test_a_kick_arrives_inside_its_window_and_not_beyond(number):
    """Beyond an edge, at the far side of its error, at least one case fails."""
    design, settings = preset('byte')
    row = load_result(RESULT_FOLDER / 'word_kicks.json')['presets']['byte']['kicks'][number]
    chain = Simulation.of(Specimen(design), settings.time).chain
    cases = cases_ahead(design.levels, 1, row['level'], row['kind'] == 'kink')
    for speed, inside in (
        (row['speed'], True), (row['low'] * 1.01, True), (row['high'] * 0.99, True),
        (row['low'] * 0.99, False), (row['high'] * 1.01, False),
    ):  # fmt: skip
        found = [kicked_behind(chain, settings.kick, each, speed) for each in cases]
        arrived = [(row['level'], *each) == one for each, one in zip(cases, found, strict=True)]
        assert all(arrived) == inside


def test_what_is_ahead_alternates_and_keeps_its_distance():
    assert cases_ahead(8, 1, 4, 0) == [(), (5, 6)]
    assert cases_ahead(8, 1, 4, 1) == [(5,), (5, 6, 7), (7,)]
    assert cases_ahead(8, 2, 4, 1) == [(6,), (7,)]
