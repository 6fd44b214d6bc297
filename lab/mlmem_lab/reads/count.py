# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Count wrong reads and writes of everything that ships or can be designed.

Every element is moved at random (written, erased, strained by hand, aborted) and read ten times in
a row after each move, from either end and both; also at half and a quarter of its step, and on
scattered specimens. Or one cell is stuck, weak, strong, light or heavy. A read or a write is wrong
if it succeeds and the wall is nearest to another level, or to none. Nothing is discarded.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np

from mlmem import Abort, Erase, MemoryElement, Read, SetStrain, Settings, Write
from mlmem.instrument.drivers import Simulation, steps_per_tick
from mlmem.physics import INTEGRATORS, Chain, Design, Specimen, StateError, find_level, find_walls
from mlmem.physics.equilibrium import find_pinned_wall
from mlmem.physics.specimen import Scatter, scattered
from mlmem.presets import PRESETS
from mlmem.readers.reading import UNDECODABLE
from mlmem.readers.register import pin_walls
from mlmem.readers.words import count_words, make_code

from ..designer import propose_design
from ..results import STRAINED_PRESETS
from ..studies.tolerance.estimate import Rate
from ..study import Study, sum_counts

DESIGN_PREFIX = 'levels_'
"""A design is named by this and its number of levels."""

SETTLE_TIME = 3000.0
"""Time in which a wall that a bad cell moves comes to rest."""


@lru_cache(maxsize=2)
def find_preset(name: str) -> tuple[Design, Settings]:
    """Return a preset, or the design for a number of levels such as `levels_24`."""
    if name in PRESETS:
        return PRESETS[name]
    found = propose_design(int(name.removeprefix(DESIGN_PREFIX)))
    return found.design, found.settings


def build_device(name: str, finer: int = 1, specimen: int | None = None) -> MemoryElement:
    """Return a blank device.

    Args:
        name: As for `find_preset`.
        finer: Number of steps in place of one of the device's.
        specimen: Number of a specimen with the scatter that its design stands; None for the ideal.
    """
    design, settings = find_preset(name)
    steps = steps_per_tick(design, settings.time) * finer
    chain = Chain(design, settings.time.tick / steps, INTEGRATORS[settings.time.integrator])
    element = MemoryElement(design, settings, driver=Simulation(chain))
    # scatter of alpha at which one step in a thousand fails, by cells per level (docs/limits.md)
    scatter_by_spacing = {25: 8e-5, 9: 4e-3}
    if specimen is not None:
        chain.set_specimen(
            scattered(design, Scatter(alpha=scatter_by_spacing.get(design.J, 0.0)), specimen)
        )
    return element


def build_faulty_device(name: str, level: int, site: int, kind: str) -> MemoryElement:
    """Return a device with its wall at rest at a level, or -1 for blank, and one bad cell.

    `kind` is 'stuck', or a factor on the cell's alpha or mass such as 'alpha 0.3' or 'mass 3'.
    """
    element = build_device(name)
    design, chain = element.design, element.chain
    blank = np.full(design.N, design.D_s1)
    if element.reader.holds_words:
        chain.place(pin_walls(Specimen(design), element.reader.list_walls(level)))
    else:
        chain.place(blank if level < 0 else find_pinned_wall(Specimen(design), level))
    what, _, factor = kind.partition(' ')
    factors = np.ones(design.N)
    factors[site - 1] = float(factor or 1.0)
    alpha, mass = (factors, 1.0) if what == 'alpha' else (1.0, factors)
    stuck = () if factor else (site,)
    chain.set_specimen(Specimen(design, alpha_factor=alpha, mass=mass, stuck=stuck))
    chain.rest(math.ceil(SETTLE_TIME / chain.dt))
    element.transducer.assume_equilibrium()
    return element


READ_ENDS = ('left', 'right', 'both')

READ_OUTCOMES = ('right', 'wrong', 'undecodable', 'no level')
"""How a read may end; the last two say 'undecodable', the last of a wall at no level or of two."""

READS_PER_MOVE = 10
"""Reads after every move."""


@dataclass
class Counts:
    """How reads and writes of one element ended.

    Attributes:
        found: Reads and writes by how they ended: `READ_OUTCOMES`; `written`, `written wrong`,
            `not written`, `second attempts`; `lost by hand`.
        blocks: Rows of reads; those of a row depend on each other and count as one.
        wrong_blocks: Rows with a wrong read.
        reasons: Why reads were undecodable and writes failed, by text.
    """

    found: Counter[str] = field(default_factory=Counter)
    blocks: int = 0
    wrong_blocks: int = 0
    ticks: list[int] = field(default_factory=list)
    reasons: Counter[str] = field(default_factory=Counter)

    @property
    def reads(self) -> int:
        """How many reads were counted: all."""
        return sum(self.found[name] for name in READ_OUTCOMES)

    def add(self, other: Counts) -> None:
        """Add the counts of other rows."""
        self.found += other.found
        self.blocks += other.blocks
        self.wrong_blocks += other.wrong_blocks
        self.ticks += other.ticks
        self.reasons += other.reasons

    def as_dict(self) -> dict[str, Any]:
        """Return the counts for a result file."""
        most = Rate(self.wrong_blocks, self.blocks).interval[1] if self.blocks else None
        return {
            'reads': self.reads,
            **{name: self.found[name] for name in READ_OUTCOMES},
            'rows': self.blocks,
            'wrong rows': self.wrong_blocks,
            'wrong rows, at most (95 %)': most,
            **{
                name: self.found[name]
                for name in (
                    'written',
                    'written wrong',
                    'not written',
                    'second attempts',
                    'lost by hand',
                )
            },
            'median ticks': float(np.median(self.ticks)) if self.ticks else None,
            'reasons': dict(self.reasons.most_common(5)),
        }


def true_level(element: MemoryElement, near: float = math.inf) -> int:
    """Return the level that the wall is nearest to, `BLANK`, or `UNDECODABLE` if it is at none; of
    many walls, the word, if they are those of one.

    Args:
        near: Distance within which a wall is at a level, in cells: half of their distance at most.
    """
    design, near = element.design, min(near, 0.5 * element.design.J)
    code = make_code(design, element.settings)
    if code is None:
        return find_level(design, element.chain.configuration, near)
    found = [round(wall.position) for wall in find_walls(design, element.chain.configuration)]
    defects = {design.defect_site(level): level for level in range(design.levels)}
    at = [min(defects, key=lambda site: abs(site - wall)) for wall in found]
    if len(set(at)) < len(at) or any(abs(a - b) > near for a, b in zip(at, found, strict=True)):
        return UNDECODABLE
    levels = sorted(defects[site] for site in at)
    return code.word(levels) if code.is_valid_word(levels) else UNDECODABLE


def count_rows(
    name: str, count: int, seed: int, finer: int = 1, specimen: int | None = None
) -> Counts:
    """Move the wall of an element at random, and read ten times after every move."""
    random = np.random.Generator(np.random.PCG64([seed, finer, specimen or 0]))
    element, counts = build_device(name, finer, specimen), Counts()
    # what happens before a row of reads: a write; an erase and a write; a strain by hand, let go;
    # a read that is aborted while it listens
    move_kinds = ('write', 'erase', 'strain', 'abort')
    for row in range(count):
        before = dict(counts.found)
        _move_wall(
            element,
            counts,
            move_kinds[row % len(move_kinds)],
            int(random.integers(element.reader.content_count)),
        )
        for number in range(READS_PER_MOVE):
            _count_read(element, counts, READ_ENDS[int(random.integers(3))] if number else '')
        counts.blocks += 1
        counts.wrong_blocks += counts.found['wrong'] > before.get('wrong', 0)
    return counts


def bad_cells(
    name: str, kind: str, site: int, write: bool = False, reach: float = math.inf
) -> Counts:
    """Read every level, and a blank element, with one bad cell; of many words a few for each site.

    Args:
        reach: Only levels so near the cell, in cells.
    """
    counts, design = Counts(), find_preset(name)[0]
    words = count_words(*find_preset(name))
    many, each = words > design.levels, words // design.levels
    for level in range(site % each, words, each) if many else range(-1, words):
        where = site if many else design.defect_site(level) if level >= 0 else design.N
        if abs(site - where) <= reach:
            element = build_faulty_device(name, level, site, kind)
            before = counts.found['wrong']
            _count_read(element, counts, '')
            if write:
                _write_level(element, counts, (level + 2) % words)
            counts.blocks += 1
            counts.wrong_blocks += counts.found['wrong'] > before
    return counts


def _move_wall(element: MemoryElement, counts: Counts, how: str, level: int) -> None:
    if how == 'erase':
        element.perform(Erase())
    hand_strain = 0.005  # strain by hand, well below that which moves a wall
    if how in ('write', 'erase'):
        _write_level(element, counts, level)
    elif how == 'strain':
        before, sign = true_level(element), (-1) ** level
        for strain in (sign * hand_strain, 0.0):
            element.apply(SetStrain(strain))
            while element.actuator.is_moving:
                element.advance()
        counts.found['lost by hand'] += true_level(element) != before
    else:
        element.apply(Read())
        for _ in range(3 + level % 32):
            element.advance()
        element.perform(Abort())


def _count_read(element: MemoryElement, counts: Counts, end: str) -> None:
    outcome = element.perform(Read(end))
    counts.ticks.append(outcome.end_tick - outcome.start_tick)
    if not outcome.success or outcome.reading is None:
        counts.found['no level' if true_level(element) == UNDECODABLE else 'undecodable'] += 1
        counts.reasons[f'{element.design.levels} levels: {outcome.error}'] += 1
    else:
        right = outcome.reading.level == true_level(element)
        counts.found['right' if right else 'wrong'] += 1
        if not right:
            counts.reasons[f'WRONG: {outcome.reading.level} at {true_level(element)}'] += 1


def _write_level(element: MemoryElement, counts: Counts, level: int) -> None:
    try:
        outcome = element.perform(Write(level))
    except StateError as stop:  # a bad cell left its range: the device stops, and says so
        counts.found['not written'] += 1
        counts.reasons[str(stop).partition(' before')[0]] += 1
        return
    wrong = outcome.success and true_level(element) != level
    counts.found['written wrong' if wrong else 'written'] += outcome.success
    counts.found['not written'] += not outcome.success
    counts.found['second attempts'] += outcome.attempts > 1
    if not outcome.success:
        counts.reasons[f'{level} of {element.design.levels}: {outcome.error}'] += 1


def sum_elements(found: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Return the sum of counts as `Counts.as_dict` gives them; it has no median."""
    summed, reasons = sum_counts(found.values()), Counter[str]()
    for each in found.values():
        reasons.update(each['reasons'])
    most = Rate(summed['wrong rows'], summed['rows']).interval[1] if summed['rows'] else None
    return {
        **Counts().as_dict(), **summed,
        'wrong rows, at most (95 %)': most, 'reasons': dict(reasons.most_common(5)),
    }  # fmt: skip


ROWS, SPECIMENS, SPECIMEN_ROWS = 100, 20, 4
"""Rows of an element as designed, fewer at finer steps; scattered specimens, and rows of each."""


BAD_CELL_SITES = {
    'case_1': (14, math.inf), 'case_2': (12, math.inf), 'bits_1': (14, math.inf),
    'bits_2': (14, math.inf), 'bits_4': (14, math.inf), 'byte': (4, math.inf),
    'levels_24': (16, 20.0), 'levels_48': (16, 20.0),
}  # fmt: skip
"""Distance of the sites of the bad cell, and how far from it the walls are that are read."""


def count_element(name: str) -> dict[str, Any]:
    """Return the counts of an element, and of its scattered specimens."""
    whole, scatter = Counts(), Counts()
    for finer in (1, 2, 4):
        whole.add(count_rows(name, math.ceil(ROWS / finer**2), SEED, finer))
    if name.startswith(DESIGN_PREFIX):
        return {name: whole.as_dict()}
    for number in range(SPECIMENS):
        scatter.add(count_rows(name, SPECIMEN_ROWS, SEED, 1, number))
    return {name: whole.as_dict(), f'{name}, scattered': scatter.as_dict()}


def count_bad_cells(name: str) -> dict[str, Any]:
    """Return the counts of an element with one bad cell, by what is wrong with it."""
    every, reach = BAD_CELL_SITES[name]
    found = {}
    bad_cell_kinds = ('stuck', 'alpha 0.3', 'alpha 3', 'mass 0.3', 'mass 3')
    for kind in bad_cell_kinds:
        counts = Counts()
        for site in range(2, find_preset(name)[0].N, every):
            counts.add(bad_cells(name, kind, site, site % (7 * every) == 2, reach))
        found[f'{name}, {kind}'] = counts.as_dict()
    return found


def add_counts(kept: Mapping[str, Any], name: str, found: Any) -> dict[str, Any]:
    """Return the counts of all elements, and their sum."""
    others = {
        key: each
        for key, each in kept.get('elements', {}).items()
        if key != 'all' and key.partition(',')[0] != name
    }
    return {'elements': others | found | {'all': sum_elements(others | found)}}


SEED = 1

STUDY = Study(
    'reads',
    count_element,
    ('case_1', *STRAINED_PRESETS, 'byte', *(f'{DESIGN_PREFIX}{n}' for n in range(2, 65))),
    ('lab/mlmem_lab/reads/count.py',),
    SEED,
    add_counts,
)

CELLS_STUDY = Study(
    'cells',
    count_bad_cells,
    tuple(BAD_CELL_SITES),
    ('lab/mlmem_lab/reads/count.py',),
    SEED,
    add_counts,
)
