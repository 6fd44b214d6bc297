# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Kicks: the committed ones are those of the code, no counted write is wrong, and the search of an
element for parts that scatter and rub finds some.
"""

import numpy as np
import pytest

from mlmem import load_element
from mlmem.moves.move import MIN_MARGIN
from mlmem.physics import Specimen, wall_energy
from mlmem.readers.reading import BLANK, UNDECODABLE
from mlmem_lab.designer.command import measure_kick_energy
from mlmem_lab.designer.search import (
    DesignNotFound,
    DesignRequest,
    build_candidate,
    choose_speeds,
    list_ranges,
    list_speeds,
    try_candidate,
)
from mlmem_lab.results import load_result
from mlmem_lab.windows.astray import count_astray
from mlmem_lab.windows.kicks import kicks_study
from mlmem_tools.checks.budget import Budget
from mlmem_tools.identification.kick_search import (
    after_erase,
    after_kick,
    build_chain,
    search_kicks,
)


def chain_of(name):
    design, settings = load_element(name).design_and_settings
    return build_chain(Specimen(design), settings)


@pytest.mark.parametrize('name', kicks_study.cases)
def test_shipped_kicks_are_those_that_were_mapped(name):
    """Each tolerates a speed a tenth off: a level whose kick tolerates less is disabled. No write
    that was counted was wrong.
    """
    design, settings = load_element(name).design_and_settings
    chain, mapped = chain_of(name), load_result(kicks_study.path)['cases'][name]
    for k in range(20, 320, 60):
        assert after_kick(chain, mapped['speeds'][k], settings.kick) == mapped['ends'][k]
    for level, speed in enumerate(settings.kick.wall_speeds):
        for factor in (1.1, 1.0 / 1.1):
            assert after_kick(chain, factor * speed, settings.kick) == level
        found = mapped['levels'][level]
        assert found['room'] >= MIN_MARGIN
        assert settings.kick.speed_margin(level) <= found['room'] + 0.005  # as it says itself
    for factor in (0.9, 1.0, 1.1):
        for level in (0, 1, design.levels - 1):
            speed = factor * settings.kick.erase_speed
            assert after_erase(chain, level, speed, settings.kick) == BLANK
    written = mapped['written']
    assert written['writes'] + written['erases'] >= 1000
    assert written['wrong'] == written['failed'] == 0
    assert written['strained'] <= 0.1 * written['writes']


def test_search_finds_kicks_as_wide_as_those_that_ship():
    settings = load_element('kick_2').settings
    found = search_kicks(chain_of('kick_2'), settings.kick, settings.transducer.max_speed)
    for level, each in enumerate(found):
        assert each.room >= settings.kick.speed_margin(level)
        assert after_kick(chain_of('kick_2'), each.speed, settings.kick) == level


def start_values(request):
    return [each.start for each in list_ranges(request).values()]


def test_laws_alone_give_nearly_a_design_of_deep_defects():
    """The search begins where most kicks of a trial, at 7.5 % of scatter, arrive."""
    request = DesignRequest(8, 0.03)
    names, shallow = list(list_ranges(request)), start_values(request)
    shallow[names.index('middle')] = shallow[names.index('side')] = 0.9
    cost = try_candidate(request, start_values(request))
    assert cost < 0.25
    assert try_candidate(request, shallow) > cost + 0.2


def test_friction_of_the_request_is_in_the_design():
    request = DesignRequest(4, 0.03, 1e-2)
    design, settings = build_candidate(request, start_values(request))
    assert design.friction == 1e-2
    assert design.levels == 4
    assert not settings.actuator.present


def test_speeds_are_the_middles_of_the_windows():
    """Of elements whose level changes at known places of the list of speeds."""
    request = DesignRequest(2, 0.03)
    values = start_values(request)
    _, settings = build_candidate(request, values)
    speeds = list_speeds(settings, 80)
    ends = np.repeat([0, 1], 40).tolist()
    _, chosen = choose_speeds(request, values, [ends] * 3)
    low, high = chosen.kick.wall_speeds
    assert low < speeds[40] < high
    with pytest.raises(DesignNotFound, match='level 1'):  # which no speed reaches
        choose_speeds(request, values, [[0] * 40 + [UNDECODABLE] * 40])


def test_fastest_kick_gives_more_than_the_energy_of_a_wall():
    shipped = load_element('robust_3')
    design, settings = shipped.design, shipped.settings
    slow, fast = (
        measure_kick_energy(design, settings, settings.kick.wall_speeds[n]) for n in (1, -1)
    )
    at_rest = wall_energy(design)
    # a slow wall has come to rest in a defect; a fast one moves, and waves go with it
    assert slow == pytest.approx(at_rest, rel=0.1)
    assert fast > at_rest + Budget(design).kick_energy


def test_paper_goes_astray_where_robust_does_not():
    """At 2 % of scatter, on elements that chose no speed."""
    for name, low, high in (('robust_3', 0.0, 0.02), ('kick_2', 0.4, 1.0)):
        shipped = load_element(name)
        found = count_astray(shipped.design, shipped.settings, 0.02, elements=10)
        assert low <= found['astray'] / found['kicks'] <= high
