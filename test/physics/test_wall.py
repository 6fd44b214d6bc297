# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Domain walls: position and sign, from configurations whose walls are known beforehand."""

import numpy as np
import pytest

from mlmem import ELEMENT_NAMES, load_element
from mlmem.physics import CASE_II, Wall, find_level, find_walls
from mlmem.physics.equilibrium import find_pinned_wall, wall_profile

D_S1, D_S2 = CASE_II.D_s1, CASE_II.D_s2


@pytest.mark.parametrize('jumps', [(), (25,), (1, 224)])
@pytest.mark.parametrize(('start', 'other'), [(D_S2, D_S1), (D_S1, D_S2)])
def test_walls_are_listed_between_their_sites_from_left_to_right(jumps, start, other):
    """Where the line through the cells meets the barrier; ripples within a phase are no walls."""
    is_other = np.searchsorted(jumps, CASE_II.sites) % 2 == 1
    phases = np.where(is_other, other, start)
    found = find_walls(CASE_II, phases)
    for wall, site in zip(found, jumps, strict=True):
        before, behind = phases[site - 1 : site + 1]
        share = (before - CASE_II.D_barrier) / (before - behind)
        assert wall == Wall(pytest.approx(site + share, abs=1e-12), bool(before > behind))
    assert len(find_walls(CASE_II, phases + 0.2 * np.sin(CASE_II.sites))) == len(jumps)


@pytest.mark.parametrize('preset', ELEMENT_NAMES)
def test_every_level_of_shipped_elements_is_recognised(preset):
    design = load_element(preset).design
    for level in sorted({0, design.levels // 2, design.levels - 1}):
        assert find_level(design, find_pinned_wall(design, level)) == level
    assert find_level(design, np.full(design.N, design.D_s1)) == -1


@pytest.mark.parametrize(
    ('position', 'kink', 'content'),
    [(95.0, False, 3), (105.0, False, 3), (5.0, False, -2), (224.4, False, -2), (100.0, True, -2)],
)
def test_wall_holds_a_level_within_the_tolerance_of_its_defect(position, kink, content):
    """Before the first level, behind the last one, and as a kink, it holds none."""
    configuration = wall_profile(CASE_II, position, kink=kink)
    assert find_level(CASE_II, configuration, tolerance=12.5) == content


@pytest.mark.parametrize('state', [-1, 0, 3])
@pytest.mark.parametrize('cells', [1, 20])
@pytest.mark.parametrize('begin', ['blank', 'level'])
def test_cells_in_third_ground_state_are_no_memory_state(state, cells, begin):
    """A wall that ran over a free end leaves such cells; no strain moves the wall between them."""
    configuration = np.full(225, D_S1) if begin == 'blank' else find_pinned_wall(CASE_II, 3)
    third = CASE_II.potential.ground_state(state)
    at = slice(0, cells) if third > D_S2 else slice(225 - cells, 225)
    assert find_level(CASE_II, configuration) in (-1, 3)
    configuration[at] = third
    assert find_level(CASE_II, configuration) == -2


def test_cell_short_of_next_barrier_is_still_in_its_phase():
    low, high = CASE_II.wells
    configuration = find_pinned_wall(CASE_II, 3)
    configuration[0], configuration[-1] = high - 1e-6, low + 1e-6
    assert find_level(CASE_II, configuration) == 3
    configuration[0] = high + 1e-6
    assert find_level(CASE_II, configuration) == -2
