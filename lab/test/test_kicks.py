# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The committed maps of kicks and pushes are those of the code, and no counted write is wrong."""

from types import SimpleNamespace

import pytest

from mlmem_lab.results import FOLDER, load
from mlmem_lab.windows.kicks import KICKED, after_kick, after_push, count, kicks
from mlmem_ros.device import preset
from mlmem_ros.device.driver import Simulation
from mlmem_ros.device.reading import BLANK

MAPPED = load(FOLDER / 'kicks.json')['presets']


@pytest.mark.parametrize('name', KICKED)
def test_the_committed_map_is_that_of_the_code(name):
    design, settings = preset(name)
    chain = Simulation.of(design, settings.time).chain
    for k in range(20, 320, 60):
        found = after_kick(chain, MAPPED[name]['speeds'][k], settings.kick)
        assert found == MAPPED[name]['ends'][k]
    top = design.levels - 1
    assert after_push(chain, top, settings.push.A, name) == BLANK


@pytest.mark.parametrize('name', KICKED)
def test_every_shipped_kick_bears_a_tenth_in_its_speed_and_half_the_hold(name):
    """What bears less is barred."""
    design, settings = preset(name)
    chain = Simulation.of(design, settings.time).chain
    for level, speed in enumerate(settings.kick.by_level):
        for factor in (1.1, 1.0 / 1.1):
            assert after_kick(chain, factor * speed, settings.kick) == level
        assert MAPPED[name]['levels'][level]['room'] >= 0.1
        assert set(MAPPED[name]['levels'][level]['holds'][1:]) == {level}  # 10 and more


@pytest.mark.parametrize('name', KICKED)
def test_no_write_of_the_committed_count_was_wrong(name):
    written = MAPPED[name]['written']
    assert written['writes'] >= 1000
    assert written['wrong'] == written['failed'] == 0


def test_writes_are_counted_and_none_strains_the_element():
    found = count('kick_2', 12, seed=1)
    assert (found['writes'], found['erases']) == (11, 1)
    assert (found['wrong'], found['failed'], found['strained']) == (0, 0, 0)


def test_a_preset_without_kicks_is_refused(capsys):
    assert kicks.run(SimpleNamespace(presets=['case_1'], figure=None)) == 2
    assert 'case_1 has no kicks' in capsys.readouterr().err
