# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The committed kicks are those of the code, and no counted write is wrong."""

import pytest

from mlmem import load_element
from mlmem.moves.move import MIN_MARGIN
from mlmem.physics import Specimen
from mlmem.readers.reading import BLANK
from mlmem_lab.results import load_result
from mlmem_lab.windows.kicks import kicks_study
from mlmem_tools.identification.kick_search import (
    after_erase,
    after_kick,
    build_chain,
    search_kicks,
)

MAPPED = load_result(kicks_study.path)['cases']


def chain_of(name):
    design, settings = load_element(name).design_and_settings
    return build_chain(Specimen(design), settings)


@pytest.mark.parametrize('name', kicks_study.cases)
def test_kick_map_is_that_of_the_code(name):
    design, settings = load_element(name).design_and_settings
    chain = chain_of(name)
    for k in range(20, 320, 60):
        found = after_kick(chain, MAPPED[name]['speeds'][k], settings.kick)
        assert found == MAPPED[name]['ends'][k]
    speed = settings.kick.erase_speed
    assert after_erase(chain, design.levels - 1, speed, settings.kick) == BLANK


@pytest.mark.parametrize('name', kicks_study.cases)
def test_every_shipped_kick_tolerates_a_speed_a_tenth_off(name):
    """A level whose kick tolerates less is disabled."""
    design, settings = load_element(name).design_and_settings
    chain = chain_of(name)
    for level, speed in enumerate(settings.kick.wall_speeds):
        for factor in (1.1, 1.0 / 1.1):
            assert after_kick(chain, factor * speed, settings.kick) == level
        found = MAPPED[name]['levels'][level]
        assert found['room'] >= MIN_MARGIN
        assert settings.kick.speed_margin(level) <= found['room'] + 0.005  # as it says itself
    for factor in (0.9, 1.1):
        for level in (0, 1, design.levels - 1):
            speed = factor * settings.kick.erase_speed
            assert after_erase(chain, level, speed, settings.kick) == BLANK


@pytest.mark.parametrize('name', kicks_study.cases)
def test_no_write_of_the_committed_count_was_wrong(name):
    written = MAPPED[name]['written']
    assert written['writes'] + written['erases'] >= 1000
    assert written['wrong'] == written['failed'] == 0
    assert written['strained'] <= 0.1 * written['writes']


def test_search_finds_kicks_as_wide_as_those_that_ship():
    settings = load_element('kick_2').settings
    found = search_kicks(chain_of('kick_2'), settings.kick, settings.transducer.max_speed)
    for level, each in enumerate(found):
        assert each.room >= settings.kick.speed_margin(level)
        assert after_kick(chain_of('kick_2'), each.speed, settings.kick) == level
