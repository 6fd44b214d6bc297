# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The committed kicks are those of the code, and no counted write is wrong."""

import json
from functools import partial
from types import SimpleNamespace

import pytest

from mlmem import preset
from mlmem.instrument.drivers import Simulation
from mlmem.moves.move import MIN_MARGIN
from mlmem.physics import (
    Specimen,
)
from mlmem.readers.reading import BLANK
from mlmem_lab.results import RESULT_FOLDER, load_result
from mlmem_lab.windows.command import windows
from mlmem_lab.windows.flight import (
    after_erase,
    after_kick,
    build_chain,
    erase_margins,
    search_kicks,
)
from mlmem_lab.windows.kicks import STUDY
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
