# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Windows of moves: measured in small, and what the presets make of those in the result file."""

import json
import re
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from mlmem import new_element, preset
from mlmem.instrument.blocks import play, run
from mlmem.instrument.drivers import Simulation
from mlmem.moves.strain_cycle import half_period, step_cycle
from mlmem_lab.results import RESULT_FOLDER, STRAINED_PRESETS
from mlmem_lab.windows import sent
from mlmem_lab.windows.command import windows
from mlmem_lab.windows.flight import erase_margins
from mlmem_lab.windows.window import (
    CHANGE_RADII,
    MAX_DRAWN_CHANGE,
    STRONG_ACTUATOR,
    bound_failures,
    describe_settings,
    end_level,
    list_moves,
    measure_window,
    strain_sequence,
)  # fmt: skip

MEASURED = json.loads((RESULT_FOLDER / 'windows.json').read_text())['presets']


def chain_of(name):
    return Simulation.of(preset(name).design, preset(name).settings.time).chain


def step_from(name, start):
    return next(m for m in list_moves(name) if m.start == start)


@pytest.mark.parametrize('start', [0, 1])
def test_a_step_is_played_as_the_device_plays_it(start):
    """In shaped ramps, by compression and by tension."""
    design, settings = preset('bits_2')
    move, chain = step_from('bits_2', start), chain_of('bits_2')
    played = strain_sequence(chain, settings, move, {})
    element, seen = new_element(design, settings), []
    cycle, delay = step_cycle(design, settings, start), half_period(design)
    run(element, play(element, cycle, delay), lambda: seen.append(element.actuator.strain))
    every = round(settings.time.tick / chain.dt) * len(chain.integrator.nodes)
    ticks = played[every - 1 :: every]
    assert len(ticks) == len(seen)
    np.testing.assert_allclose(ticks[:-1], seen[1:], atol=1e-12)


def test_the_strong_actuator_changes_no_move_as_shipped():
    for name in STRAINED_PRESETS:
        design, settings = preset(name)
        for move in list_moves(name):
            strong = settings.__class__(**{**settings.groups(), 'actuator': STRONG_ACTUATOR})
            cycles = [step_cycle(design, each, move.start) for each in (strong, settings)]
            assert cycles[0] == cycles[1]


def test_a_wall_that_is_left_behind_is_seen():
    """A step of a tenth of its strength does not move it."""
    chain, settings = chain_of('bits_2'), preset('bits_2').settings
    step = step_from('bits_2', 1)
    assert end_level(chain, settings, step, {}) == 2
    assert end_level(chain, settings, step, {'compression': -0.9, 'tension': -0.9}) == 1


def test_a_window_of_a_small_preset_is_measured_as_the_file_has_it():
    found = measure_window('bits_2', step_from('bits_2', 1), radii=(0.15,)).as_dict()
    assert found['points'] == 0
    assert found['distance'] == 0.15
    [kept] = [m for m in MEASURED['bits_2']['moves'] if m['from'] == 1]
    assert found['failures'] == [each for each in kept['failures'] if each[0] == 0.15]


def test_what_was_drawn_bounds_what_may_fail():
    """19 in 20 samples of 100 would show a failure that is as frequent as the bound."""
    there = json.loads((RESULT_FOLDER / 'windows.json').read_text())
    assert bound_failures(there['presets']) == there['drawn']
    assert (1.0 - there['drawn']['share of these, at most (95 %)']) ** 100 == pytest.approx(0.05)
    assert bound_failures({})['share of these, at most (95 %)'] == 1.0


def asked(*presets, **others):
    given = {
        'points': 0,
        'seed': 5,
        'radii': CHANGE_RADII,
        'integrator': None,
        'workers': 1,
        'output': None,
        'element': None,
        'method': 'auto',
        'json': False,
    }
    return SimpleNamespace(presets=list(presets), **{**given, **others})


def test_the_command_measures_prints_and_keeps_what_the_file_has(tmp_path, capsys):
    path = tmp_path / 'windows.json'
    path.write_text(json.dumps({'presets': {'bits_2': MEASURED['bits_2']}}))
    assert windows.run(asked('bits_1', radii=[0.1], method='strain', output=path)) == 0
    found = json.loads(path.read_text())['presets']
    assert list(found) == ['bits_2', 'bits_1']
    assert [m['distance'] for m in found['bits_1']['moves']] == [None]
    assert 'bits_1' in capsys.readouterr().out


@pytest.mark.parametrize(
    ('wrong', 'said'),
    [
        ({'presets': ['bits_7']}, "element must be one of case_1, .*; got 'bits_7'"),
        ({'method': 'kick', 'output': Path('x')}, '--output is for moves .* that strain'),
        ({'workers': 0}, '--workers must be at least 1'),
        ({'points': -1}, '--points and --seed must be at least 0'),
        ({'radii': [1.0]}, '--radii must be above 0 and below 1'),
    ],
)
def test_misuse_is_named(wrong, said, capsys):
    given = asked()
    vars(given).update(wrong)
    assert windows.run(given) == 2
    assert re.search(said, capsys.readouterr().err)


@pytest.mark.parametrize('name', STRAINED_PRESETS)
def test_the_file_is_of_the_shipped_settings_and_has_no_narrow_step(name):
    there = MEASURED[name]
    assert there['settings'] == describe_settings(name)
    assert tuple(there['radii']) == CHANGE_RADII
    distances = {m['from']: m['distance'] for m in there['moves']}
    assert set(distances) == {move.start for move in list_moves(name)}
    assert all(far is None or far > MAX_DRAWN_CHANGE for far in distances.values())


def test_kicks_have_rows_of_their_own(tmp_path, capsys, monkeypatch):
    """An element file, whose last kick is a fifth too slow: it fails as shipped. Those that
    erase are tried that are off by up to a twentieth.
    """
    monkeypatch.setattr(sent, 'erase_margins', partial(erase_margins, farthest=0.05))
    speeds = '0.0031, 0.0103, 0.0222, 0.0294'
    file = tmp_path / 'slow.yaml'
    file.write_text(
        'format: 1\nbased_on: kick_2\nkick:\n'
        f'  speeds: [{speeds}]\n  rooms: [0.5, 0.05, 0.3, 0.2]\n'
    )
    assert windows.run(asked(str(file), radii=(), json=True)) == 1
    told = json.loads(capsys.readouterr().out)[str(file)]
    assert told['moves']  # by strain, of which nothing was asked but how they end as they are
    found = told['sent']
    assert [each['how'] for each in found] == ['kick'] * 4 + ['kick out'] * 4
    assert [each['used'] for each in found[:4]] == [True, False, True, True]
    assert [level for level, each in enumerate(found) if not any(each['rooms'].values())] == [3]
    known = json.loads((RESULT_FOLDER / 'kicks.json').read_text())['presets']['kick_2']['levels']
    assert [each['rooms'] for each in found[:3]] == [each['rooms'] for each in known[:3]]
