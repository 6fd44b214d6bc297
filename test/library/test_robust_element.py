# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The robust elements as devices: written by kicks, read by the waveform of one pulse."""

import numpy as np
import pytest

from mlmem import Erase, MemoryElement, Read, Write, load_element
from mlmem.instrument.drivers import Simulation
from mlmem.physics import Specimen, find_walls
from mlmem_tools.checks import Verdict, check

SCATTER = 0.03  # of stiffnesses, springs and masses, all at once


def make_scattered(name, seed):
    """Return an element whose parts scatter, with the settings of its file alone."""
    shipped, random = load_element(name), np.random.default_rng(seed)
    design = shipped.design
    made = Specimen(
        design,
        alpha_factor=1.0 + SCATTER * random.standard_normal(design.N),
        k_r_factor=1.0 + SCATTER * random.standard_normal(design.N - 1),
        mass=1.0 + SCATTER * random.standard_normal(design.N),
    )
    settings = shipped.settings
    return MemoryElement(design, settings, driver=Simulation.of(made, settings.time))


@pytest.mark.parametrize('name', ['robust_2', 'robust_3'])
def test_robust_element_as_designed_writes_reads_and_erases_every_level(name):
    element = MemoryElement(load_element(name))
    for level in reversed(range(element.design.levels)):
        assert element.perform(Write(level)).success
        assert element.perform(Read()).reading.content == level
    assert element.perform(Erase()).success
    assert find_walls(element.design, element.chain.configuration) == []


@pytest.mark.parametrize('name', ['robust_2', 'robust_3'])
@pytest.mark.parametrize('seed', range(4))
def test_robust_element_of_scattered_parts_acknowledges_no_wrong_level(name, seed):
    """The wall must rest within a quarter of a level, at most 1.5 cells, where it is reported."""
    element, random = make_scattered(name, seed), np.random.default_rng(1000 + seed)
    design, written = element.design, 0
    for level in map(int, random.integers(design.levels, size=8)):
        outcome = element.perform(Write(level))
        if outcome.success:
            (wall,) = find_walls(design, element.chain.configuration)
            limit = min(1.5, design.J / 4.0)
            assert wall.position == pytest.approx(design.defect_site(level), abs=limit)
            written += 1
    assert written >= 6


@pytest.mark.parametrize('name', ['robust_2', 'robust_3'])
def test_robust_element_is_not_refused_by_the_design_check(name):
    """A node refuses an element whose check fails."""
    shipped = load_element(name)
    report = check(shipped.design, shipped.settings)
    assert [each.name for each in report.findings if each.verdict is Verdict.FAIL] == []
