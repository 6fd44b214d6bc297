# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Count the levels, reads and writes that are left with a known bad cell.

A blank element gets one bad cell, at every so many sites, and is told of it (`element.bad_cells`).
Every level that can be used is written from below and once more in random order, erased too, and
read each time. At every second site the element is then told wrongly, of no cell, of one elsewhere
or of one that is sound, and read with its wall at rest at every level. A read or a write is wrong
if it succeeds and the wall is at another level. Nothing is discarded.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from mlmem import BLANK, Erase, Faults, MemoryElement, Read, SettingsError, Write, load_element
from mlmem.factory import rehearse_levels
from mlmem.physics import StateError
from mlmem.readers.register import pin_walls
from mlmem.settings import ElementSettings

from ..study import Study, sum_counts
from .count import judge_read, judge_write, reads_study

Rng = np.random.Generator


def build_element(name: str, told: str, faults: Faults) -> MemoryElement:
    """Return a blank element that is told of bad cells, with faults that may be others."""
    design, settings = load_element(name).design_and_settings
    element = MemoryElement(design, replace(settings, element=ElementSettings(told)))
    element.set_faults(faults)
    return element


def use_element(name: str, told: str, faults: Faults, random: Rng) -> Counter[str]:
    """Write, read and erase with a cell that is known; count how that ended."""
    design, settings = load_element(name).design_and_settings
    found = Counter[str](cells=1, levels=design.levels)
    try:
        rehearse_levels(design, replace(settings, element=ElementSettings(told)))
    except SettingsError:
        found['lost'] += 1
        return found
    element = build_element(name, told, faults)
    usable = tuple(element.reader.single_walls)
    found['usable'] += len(usable)
    for level in (*usable, *random.permutation([*usable, BLANK]).tolist()):
        done = element.perform(Erase() if level == BLANK else Write(level))
        found += Counter(['writes', judge_write(element, done, level)])
        found += _count_read(element)
    return found


def misinform_element(name: str, told: str, faults: Faults) -> Counter[str]:
    """Read every level of an element that is told of the wrong cells."""
    design, settings = load_element(name).design_and_settings
    found = Counter[str]()
    try:
        if told:
            rehearse_levels(design, replace(settings, element=ElementSettings(told)))
    except SettingsError:
        return found
    for level in range(BLANK, design.levels):
        element = build_element(name, told, faults)
        try:
            made = element.chain.specimen
            element.chain.place(pin_walls(made, () if level == BLANK else (level,)))
        except StateError:
            continue
        element.transducer.assume_equilibrium()
        found += _count_read(element)
    return found


def _count_read(element: MemoryElement) -> Counter[str]:
    names = {'right': 'read', 'wrong': 'read wrong'}
    return Counter(['reads', names.get(judge_read(element, element.perform(Read())), '')])


def measure_element(name: str, seed: int) -> dict[str, Any]:
    """Count an element with a bad cell at every so many sites."""
    result: dict[str, Any] = {}
    random = np.random.Generator(np.random.PCG64(seed))
    design = load_element(name).design
    spacing = {'case_2': 12}.get(name, 2)  # cells between the sites of the bad cell
    names = ('cells', 'lost', 'levels', 'usable', 'writes', 'written', 'written wrong', 'reads',
             'read', 'read wrong')  # fmt: skip
    wrongly = Counter[str]()
    # by name: how an element is told of a cell, and the fault
    cell_faults: dict[str, Callable[[int], tuple[str, Faults]]] = {
        'stuck': lambda site: (f'{site}', Faults(stuck_cell=site)),
        'half as stiff': lambda site: (f'{site}:0.5', Faults(weak_cell=site, weak_factor=0.5)),
    }
    for kind, of in cell_faults.items():
        found = Counter[str]()
        for number, site in enumerate(range(2, design.N, spacing)):
            told, faults = of(site)
            found += use_element(name, told, faults, random)
            if number % 2:
                continue
            elsewhere = int(random.integers(2, design.N))
            for other in ('', f'{elsewhere}'):
                wrongly += misinform_element(name, other, faults)
            wrongly += misinform_element(name, told, Faults())
        result[kind] = {each: found[each] for each in names}
    result['told wrongly'] = {each: wrongly[each] for each in ('reads', 'read', 'read wrong')}
    return result


def sum_presets(presets: Mapping[str, Any]) -> dict[str, Any]:
    """Return the sums of all presets: of known cells, and of cells that were told wrongly."""
    counts = [item for each in presets.values() for item in each.items()]
    return {
        'all': sum_counts(found for kind, found in counts if kind != 'told wrongly'),
        'told wrongly': sum_counts(found for kind, found in counts if kind == 'told wrongly'),
    }


bad_cells_study = Study(
    'bad_cells',
    measure_element,
    ('bits_1', 'bits_2', 'case_2'),
    ('lab/mlmem_lab/reads/bad_cells.py', *reads_study.modules),
    1,
    sum_presets,
)
