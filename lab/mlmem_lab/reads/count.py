# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Count wrong reads and writes of the elements that strain writes, and of a byte.

Every element is moved at random (written, erased, strained by hand, aborted) and read ten times in
a row after each move, from either end and both; also at half and a quarter of its step, and on
scattered specimens. A read or a write is wrong if it succeeds and the wall is nearest to another
level, or to none. Nothing is discarded.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mlmem import Abort, Erase, MemoryElement, Read, SetStrain, Write, load_element
from mlmem.instrument.drivers import Simulation
from mlmem.physics import Design, Specimen, StateError, find_level, find_walls
from mlmem.physics.specimen import Scatter, scattered
from mlmem.readers.reading import UNDECODABLE
from mlmem.readers.words import make_code

from ..results import STRAINED_PRESETS
from ..studies.tolerance.estimate import Rate
from ..study import Study, sum_counts

MODERATE_SCATTERS = {25: 8e-5, 9: 4e-3}
"""Scatter of alpha at which one step in a thousand fails, by cells per level (docs/limits.md)."""


def build_device(name: str, finer: int = 1, specimen: int | None = None) -> MemoryElement:
    """Return a blank device of a preset.

    Args:
        finer: Number of steps in place of one of the device's.
        specimen: Number of a specimen with the scatter that its design stands; None for the ideal.
    """
    design, settings = load_element(name).design_and_settings
    made: Design | Specimen = design
    if specimen is not None:
        made = scattered(design, Scatter(alpha=MODERATE_SCATTERS.get(design.J, 0.0)), specimen)
    driver = Simulation.of(made, settings.time, finer)
    return MemoryElement(design, settings, driver=driver)


READ_ENDS = ('left', 'right', 'both')

READ_OUTCOMES = ('right', 'wrong', 'undecodable', 'no level')
"""How a read may end; the last two say 'undecodable', the last of a wall at no level or of two."""

READS_PER_MOVE = 10
"""Reads after every move."""


COUNTED_WRITES = ('written', 'written wrong', 'not written', 'second attempts', 'lost by hand')
"""How writes may end, and walls that a strain by hand moved."""


@dataclass
class Counts:
    """How reads and writes of one element ended.

    Attributes:
        found: Reads and writes by how they ended: `READ_OUTCOMES` and `COUNTED_WRITES`; `rows` of
            reads, of which those of a row depend on each other and count as one; `wrong rows`.
        reasons: Why reads were undecodable and writes failed, by text.
    """

    found: Counter[str] = field(default_factory=Counter)
    ticks: list[int] = field(default_factory=list)
    reasons: Counter[str] = field(default_factory=Counter)

    @property
    def reads(self) -> int:
        """How many reads were counted: all."""
        return sum(self.found[name] for name in READ_OUTCOMES)

    def add(self, other: Counts) -> None:
        """Add the counts of other rows."""
        self.found += other.found
        self.ticks += other.ticks
        self.reasons += other.reasons

    def as_dict(self) -> dict[str, Any]:
        """Return the counts for a result file."""
        names = (*READ_OUTCOMES, 'rows', 'wrong rows', *COUNTED_WRITES)
        counts = {'reads': self.reads, **{name: self.found[name] for name in names}}
        return summarise_rows(counts, self.reasons) | {
            'median ticks': float(np.median(self.ticks)) if self.ticks else None
        }


def summarise_rows(counts: Mapping[str, int], reasons: Counter[str]) -> dict[str, Any]:
    """Return counts with the upper end of the share of wrong rows, and the commonest reasons."""
    rows = counts['rows']
    most = Rate(counts['wrong rows'], rows).interval[1] if rows else None
    return {
        **counts, 'wrong rows, at most (95 %)': most, 'reasons': dict(reasons.most_common(5)),
    }  # fmt: skip


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
        before = counts.found['wrong']
        _move_wall(
            element,
            counts,
            move_kinds[row % len(move_kinds)],
            int(random.integers(element.reader.content_count)),
        )
        for number in range(READS_PER_MOVE):
            _count_read(element, counts, READ_ENDS[int(random.integers(3))] if number else '')
        counts.found['rows'] += 1
        counts.found['wrong rows'] += counts.found['wrong'] > before
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


SEED, SPECIMENS = 1, 20


def count_element(name: str, count: int = 800) -> dict[str, Any]:
    """Return the counts of an element as designed and of specimens that scatter.

    Args:
        count: Rows as designed; fewer at finer steps, and half as many of all specimens.
    """
    ideal, scatter = Counts(), Counts()
    for finer in (1, 2, 4):
        ideal.add(count_rows(name, math.ceil(count / finer**2), SEED, finer))
    for number in range(SPECIMENS):
        scatter.add(count_rows(name, math.ceil(0.5 * count / SPECIMENS), SEED, 1, number))
    return {'ideal': ideal.as_dict(), 'scattered': scatter.as_dict()}


def sum_presets(presets: Mapping[str, Any]) -> dict[str, Any]:
    """Return the sums over all presets: ideal, scattered and all; they have no median."""

    def sum_kinds(*kinds: str) -> dict[str, Any]:
        reasons = Counter[str]()
        parts = [found[kind] for found in presets.values() for kind in kinds]
        for each in parts:
            reasons.update(each['reasons'])
        return summarise_rows(sum_counts(parts), reasons)

    return {
        'ideal': sum_kinds('ideal'), 'scattered': sum_kinds('scattered'),
        'all': sum_kinds('ideal', 'scattered'),
    }  # fmt: skip


STUDY = Study(
    'reads',
    count_element,
    (*STRAINED_PRESETS, 'byte'),
    ('lab/mlmem_lab/reads/count.py',),
    SEED,
    sum_presets,
    is_sized=True,
)
