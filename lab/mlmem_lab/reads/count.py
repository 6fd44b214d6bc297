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
from typing import Any

import numpy as np

from mlmem import Abort, Erase, MemoryElement, Outcome, Read, SetStrain, Write, load_element
from mlmem.instrument.drivers import Simulation
from mlmem.physics import Design, Specimen, StateError, find_level, find_walls
from mlmem.physics.specimen import Scatter, draw_specimen
from mlmem.readers.reading import UNDECODABLE
from mlmem.readers.words import make_code

from ..results import list_strained_presets
from ..studies.tolerance.estimate import Rate
from ..study import Study


def build_device(name: str, finer: int = 1, specimen: int | None = None) -> MemoryElement:
    """Return a blank device of a preset.

    Args:
        finer: Number of steps in place of one of the device's.
        specimen: Number of a specimen with the scatter that its design stands; None for the ideal.
    """
    design, settings = load_element(name).design_and_settings
    made: Design | Specimen = design
    if specimen is not None:
        # of alpha, at which one step in a thousand fails, by cells per level (docs/limits.md)
        alpha = {25: 8e-5, 9: 4e-3}.get(design.J, 0.0)
        made = draw_specimen(design, Scatter(alpha=alpha), specimen)
    driver = Simulation.build_blank(made, settings.time, finer)
    return MemoryElement(design, settings, driver=driver)


READS_PER_MOVE = 10
"""Reads after every move."""

READ_OUTCOMES = ('right', 'wrong', 'undecodable', 'no level')
"""How a read may end; the last two say 'undecodable', the last of a wall at no level or of two."""

COUNTED_NAMES = (
    *READ_OUTCOMES, 'rows', 'wrong rows', 'written', 'written wrong', 'not written',
    'second attempts', 'lost by hand',
)  # fmt: skip
"""What is counted: `rows` of reads, of which those of a row depend on each other and count as one;
walls that a strain by hand moved. Counters also have the reasons why reads were undecodable and
writes failed, by text."""


def describe_counts(found: Counter[str]) -> dict[str, Any]:
    """Return counts for a result file, with the upper end of the share of wrong rows, and the
    commonest reasons.
    """
    counts = {name: found[name] for name in COUNTED_NAMES}
    reasons = Counter({text: times for text, times in found.items() if text not in COUNTED_NAMES})
    most = Rate(counts['wrong rows'], counts['rows']).interval[1] if counts['rows'] else None
    return {
        'reads': sum(counts[name] for name in READ_OUTCOMES),
        **counts,
        'wrong rows, at most (95 %)': most,
        'reasons': dict(reasons.most_common(5)),
    }


def judge_read(element: MemoryElement, outcome: Outcome) -> str:
    """Return how a read ended, one of `READ_OUTCOMES`."""
    true = true_level(element)
    if not outcome.success or outcome.reading is None:
        return 'no level' if true == UNDECODABLE else 'undecodable'
    return 'right' if outcome.reading.level == true else 'wrong'


def judge_write(element: MemoryElement, outcome: Outcome, content: int) -> str:
    """Return how a write of a content, or an erase, ended: written, written wrong, not written."""
    if not outcome.success:
        return 'not written'
    return 'written' if true_level(element) == content else 'written wrong'


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
) -> Counter[str]:
    """Move the wall of an element at random, and read ten times after every move."""
    random = np.random.Generator(np.random.PCG64([seed, finer, specimen or 0]))
    element, found = build_device(name, finer, specimen), Counter[str]()
    # what happens before a row of reads: a write; an erase and a write; a strain by hand, let go;
    # a read that is aborted while it listens
    move_kinds = ('write', 'erase', 'strain', 'abort')
    for row in range(count):
        before = found['wrong']
        content = int(random.integers(element.reader.content_count))
        found += _move_wall(element, move_kinds[row % len(move_kinds)], content)
        for number in range(READS_PER_MOVE):
            end = ('left', 'right', 'both')[int(random.integers(3))] if number else ''
            outcome = element.perform(Read(end))
            found[how := judge_read(element, outcome)] += 1
            if how == 'wrong':
                found[f'WRONG: {outcome.level} at {true_level(element)}'] += 1
            elif how != 'right':
                found[f'{element.design.levels} levels: {outcome.error}'] += 1
        found['rows'] += 1
        found['wrong rows'] += found['wrong'] > before
    return found


def _move_wall(element: MemoryElement, how: str, content: int) -> Counter[str]:
    """Move the wall in some way; return what is counted of that."""
    if how == 'erase':
        element.perform(Erase())
    if how in ('write', 'erase'):
        return _write_content(element, content)
    if how == 'abort':
        element.apply(Read())
        for _ in range(3 + content % 32):
            element.advance()
        element.perform(Abort())
        return Counter()
    hand_strain = 0.005  # strain by hand, well below that which moves a wall
    before, sign = true_level(element), (-1) ** content
    for strain in (sign * hand_strain, 0.0):
        element.apply(SetStrain(strain))
        while element.actuator.is_moving:
            element.advance()
    return Counter({'lost by hand': int(true_level(element) != before)})


def _write_content(element: MemoryElement, content: int) -> Counter[str]:
    try:
        outcome = element.perform(Write(content))
    except StateError as stop:  # a bad cell left its range: the device stops, and says so
        return Counter(['not written', str(stop).partition(' before')[0]])
    found = Counter([judge_write(element, outcome, content)])
    found['second attempts'] += outcome.attempts > 1
    if not outcome.success:
        found[f'{content} of {element.design.levels}: {outcome.error}'] += 1
    return found


def count_element(name: str, seed: int, count: int = 800) -> dict[str, Any]:
    """Return the counts of an element as designed and of specimens that scatter.

    Args:
        count: Rows as designed; fewer at finer steps, and half as many of all specimens.
    """
    ideal, scatter, specimen_count = Counter[str](), Counter[str](), 20
    for finer in (1, 2, 4):
        ideal += count_rows(name, math.ceil(count / finer**2), seed, finer)
    for number in range(specimen_count):
        scatter += count_rows(name, math.ceil(0.5 * count / specimen_count), seed, 1, number)
    return {'ideal': describe_counts(ideal), 'scattered': describe_counts(scatter)}


def sum_presets(presets: Mapping[str, Any]) -> dict[str, Any]:
    """Return the sums over all presets: ideal, scattered and all."""

    def sum_kinds(*kinds: str) -> dict[str, Any]:
        found = Counter[str]()
        for part in (counts[kind] for counts in presets.values() for kind in kinds):
            found.update({name: part[name] for name in COUNTED_NAMES} | part['reasons'])
        return describe_counts(found)

    return {
        'ideal': sum_kinds('ideal'), 'scattered': sum_kinds('scattered'),
        'all': sum_kinds('ideal', 'scattered'),
    }  # fmt: skip


reads_study = Study(
    'reads',
    count_element,
    (*list_strained_presets(), 'byte'),
    ('lab/mlmem_lab/reads/count.py', 'lab/mlmem_lab/studies/tolerance/estimate.py'),
    1,
    sum_presets,
    is_sized=True,
)
