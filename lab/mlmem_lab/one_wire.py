# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Count reads of the element with one transducer, with one bad cell anywhere.

Every element scatters by 3 % and has one bad cell, which was bad before its calibration or became
so after it. Each content is placed, comes to rest beside the cell, and is read. A read is wrong if
it succeeds and the wall rests farther than 1.5 cells from the level. An element whose calibration
fails is refused; that is right with a bad cell.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np

from mlmem import BLANK, Calibrate, MemoryElement, Outcome, Read, load_element
from mlmem.instrument.drivers import Simulation
from mlmem.physics import Scatter, Specimen, StateError, draw_specimen
from mlmem.physics.wall import arrival_tolerance
from mlmem.readers.register import pin_walls

from .reads.count import reads_study, true_level
from .study import Study

CELL_FACTORS: dict[str, dict[str, float]] = {
    'stuck': {},
    'alpha 0.3': {'alpha': 0.3},
    'alpha 3': {'alpha': 3.0},
    'mass 2': {'mass': 2.0},
}
"""Factors of a bad cell by what is wrong with it; one that is stuck has none."""


def break_cell(made: Specimen, kind: str, site: int) -> Specimen:
    """Return an element that differs from another one in one cell."""
    factors = CELL_FACTORS[kind]
    alpha, mass = np.array(made.alpha_factor), np.array(made.mass)
    alpha[site - 1] *= factors.get('alpha', 1.0)
    mass[site - 1] *= factors.get('mass', 1.0)
    stuck = () if factors else (site,)
    return replace(made, alpha_factor=alpha, mass=mass, stuck=stuck)


def settle_broken(element: MemoryElement, broken: Specimen) -> None:
    """Exchange an element's cells, and wait until a wall that a bad one moves has come to rest."""
    element.chain.set_specimen(broken)
    element.chain.advance_steps(math.ceil(3000.0 / element.chain.dt))
    element.transducer.assume_equilibrium()
    element.forget_content('a cell broke')


def judge_settled_read(element: MemoryElement, outcome: Outcome) -> str:
    """Return how a read ended: 'right', 'undecodable', or 'wrong', also of a wall at no level."""
    if not outcome.success:
        return 'undecodable'
    true = true_level(element, arrival_tolerance(element.design))
    return 'right' if outcome.level == true else 'wrong'


def count_case(case: str, seed: int) -> dict[str, Any]:
    """Return how the calibrations and reads of the elements of a case ended."""
    kind, _, when = case.partition(', ')
    found = Counter[str]()
    first_seed = seed + 1000 * one_wire_study.cases.index(case)
    # a cell that is bad before needs an element, and so a calibration, of its own
    for number in range(24 if when == 'before' else 10):
        found += _count_element(kind, when, first_seed + number)
    return {
        name: found[name]
        for name in ('elements', 'refused', 'reads', 'right', 'undecodable', 'wrong')
    }


def _count_element(kind: str, when: str, seed: int) -> Counter[str]:
    shipped, found = load_element('robust_3_one_end'), Counter[str](elements=1)
    design, random = shipped.design, np.random.default_rng(seed)
    good = draw_specimen(design, Scatter(alpha=0.03, k_r=0.03, mass=0.03), seed)
    # sites of the bad cell, one after the other
    sites = random.permutation(np.arange(2, design.N))[: 1 if when == 'before' else 12]
    broken = [break_cell(good, kind, int(site)) for site in sites]
    driver = Simulation.build_blank(broken[0] if when == 'before' else good, shipped.settings.time)
    element = MemoryElement(design, shipped.settings, driver=driver)
    try:
        is_calibrated = element.perform(Calibrate()).success
    except StateError:  # a cell left its range: the device stops
        is_calibrated = False
    if not is_calibrated:
        return found + Counter(refused=1)
    for bad in broken:
        for content in range(BLANK, design.levels):
            try:
                element.chain.place(pin_walls(good, (content,) if content >= 0 else ()))
            except StateError:  # the good element does not hold it
                continue
            settle_broken(element, bad)
            found += Counter(['reads', judge_settled_read(element, element.perform(Read()))])
    return found


one_wire_study = Study(
    'one_wire',
    count_case,
    tuple(f'{kind}, {when}' for kind in CELL_FACTORS for when in ('before', 'after')),
    ('lab/mlmem_lab/one_wire.py', 'config/robust_3_one_end.yaml', *reads_study.modules),
    seed=900,
)
