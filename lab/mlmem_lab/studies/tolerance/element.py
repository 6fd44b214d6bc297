# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One random element: every level is read from an end, or every step up is tried once; of many
walls, some random words are written or read.

Each level is tried on its own: the wall is put where it rests in this element (by Newton's
method), and read, or driven on by a write of the next level; or a word is kicked into the blank
element, or put at rest and heard. So one element samples every step or
read, and a failed step does not spoil the others. A point of a study counts a batch of elements
with one kind of randomness.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mlmem import UNDECODABLE, Faults, MemoryElement, SetFaults
from mlmem.errors import ProcedureFailed
from mlmem.instrument.blocks import Procedure, run, wait
from mlmem.moves.kick import kick
from mlmem.parsing import decode_value
from mlmem.physics import (
    Design,
    DesignError,
    Scatter,
    Specimen,
    StateError,
    find_level,
    find_walls,
    scattered,
)
from mlmem.physics.equilibrium import find_pinned_wall, make_blank
from mlmem.physics.potential import Array
from mlmem.procedures.driving import go_to_level
from mlmem.readers.reading import Reading
from mlmem.readers.register import MAX_LEVEL_OFFSET_CELLS, pin_walls
from mlmem.readers.words import count_words, make_code
from mlmem.rng import Stream, make_generator
from mlmem.settings import Settings

from ..bench import Bench
from ..campaign import Row
from ..campaign.campaign import Values
from ..trace import wall_position
from .particle import DRAWN_PER_SCREENED, FORECAST_KINDS, StepForecast, draw_weights

SETTLE_DAMPING_TIMES = 5.0
"""Damping times after a step: the gradient may still roll the wall to its defect for two."""

LONG_TICK = 100.0
"""Tick of a read: it rounds waits up, and does not change the material."""


@dataclass(frozen=True)
class Chance:
    """What is random, as standard deviations.

    Attributes:
        scatter: Of the fabrication.
        noise: Of the transducers' signals, in cells.
        vibration: Of the base's acceleration, in lattice constants per time unit squared: drawn
            anew for every tick of the instrument, and linear between.
        damping: Of an element's damping, relative.
        gain: Of the gain of an element's transducers, relative.
    """

    scatter: Scatter = field(default_factory=Scatter)
    noise: float = 0.0
    vibration: float = 0.0
    damping: float = 0.0
    gain: float = 0.0


STEP_TRIAL = 'step'
"""What is tried: a step up. A read is named by its end."""

KICK_TRIAL = 'kick'
"""Also: a kick from the blank element to a level, with the speed of the ideal one."""

WORD_TRIAL = 'word'
"""Of many walls: a random word is kicked into the blank element, and not verified."""

READ_TRIAL = 'hear'
"""Of many walls: a random word that rests is read in one pulse."""

BLIND_TRIAL = 'blind'
"""Of many walls: as `WORD_TRIAL`, then read: what a word is that nobody verified."""

WORD_TRIALS = WORD_TRIAL, READ_TRIAL, BLIND_TRIAL

FAR, SHORT, ANNIHILATED, LOST = -3, -4, -5, -6
"""How a word fails, by the first wall, from the right, that is not at its level: it ran on, or
stopped before; or an even number of walls is missing, or anything else happened."""

ASTRAY_NAMES = {FAR: 'far', SHORT: 'short', ANNIHILATED: 'annihilated', LOST: 'lost'}
"""Their names."""

MISREAD_KINDS = 'undecodable', 'silent', 'paired'
"""How a read of a word fails: it tells nothing, or another word, which may have two walls more or
fewer, or six: where a wall and a kink meet, both are gone.
"""

WORDS_PER_ELEMENT = 8
"""Words that are tried in each element."""

MAX_ARRIVAL_ERROR_CELLS = 1.0
"""Distance in cells from its rest position in this element within which a wall has arrived. One
that stops on its way reads as the nearest level, but the next cycle starts at the wrong place."""

GLOBAL_KINDS = 'noise', 'vibration', 'damping', 'gain'

ALL_KINDS = (*(one.name for one in dataclasses.fields(Scatter)), *GLOBAL_KINDS)
"""Names of what may be random."""


def single_chance(kind: str, amount: float) -> Chance:
    """Return randomness of one kind only."""
    changed: dict[str, Any] = {kind: amount}
    return Chance(**changed) if kind in GLOBAL_KINDS else Chance(Scatter(**changed))


def expected_outcomes(design: Design, tried: str) -> tuple[int, ...]:
    """Return what `try_element` gives for an ideal element; of words, for which each is its own
    answer, so many numbers.
    """
    if tried in WORD_TRIALS:
        return tuple(range(WORDS_PER_ELEMENT))
    return tuple(range(1, design.levels) if tried == STEP_TRIAL else range(design.levels))


def try_element(
    design: Design,
    settings: Settings,
    by: Chance,
    seed: int,
    tried: str,
    levels: Sequence[int] | None = None,
) -> tuple[int, ...]:
    """Make a random element and try its steps up, or its reads from an end.

    It is read with the calibration of the ideal element.

    Args:
        seed: Of the element: the same gives the same outcome.
        tried: `STEP_TRIAL`, `KICK_TRIAL`, one of `WORD_TRIALS`, or the end that is read from.
        levels: The levels to step from or to read, or the words; by default all levels.

    Returns:
        For every one of these levels the level to which a write of the next one took the wall, or
        for a kick the level where it ended, or for reads the decoded level. `UNDECODABLE` if the
        element pins no wall at the level, and for steps and kicks unless exactly one wall ends at
        rest at a level. A word that was not written is one of `ASTRAY_NAMES`.

    Raises:
        DesignError: The element cannot be simulated with the step of the ideal one.
    """
    if tried != STEP_TRIAL and not by.vibration:
        settings = dataclasses.replace(
            settings, time=dataclasses.replace(settings.time, tick=LONG_TICK)
        )
    element = Bench(design, settings).device()
    damping, gain = 1.0 + make_generator(seed, Stream.GAIN).standard_normal(2) * (
        by.damping,
        by.gain,
    )
    faults = Faults(sensor_noise=by.noise, sensor_gain=float(gain), seed=seed % 2**31)
    element.apply(SetFaults(faults))
    specimen = scattered(design, by.scatter, seed)
    specimen = dataclasses.replace(specimen, eta_factor=max(float(damping), 0.0))
    element.chain.set_specimen(specimen)
    made = _Made(element, specimen, by.vibration, seed)
    levels = range(len(expected_outcomes(design, tried))) if levels is None else levels
    return tuple(made.outcome(level, tried) for level in levels)


class _Made:
    """A random element, on a base that may shake."""

    def __init__(
        self, element: MemoryElement, specimen: Specimen, vibration: float, seed: int
    ) -> None:
        self._element = element
        self._specimen = specimen
        self._vibration = vibration
        self._limit = element.settings.disturbance.max_acceleration
        self._random = np.random.Generator(np.random.PCG64(seed))

    def outcome(self, level: int, tried: str) -> int:
        """Put the wall at rest at a level, and return what `try_element` says of it."""
        if tried in WORD_TRIALS:
            return self._try_word(level, tried)
        try:
            wall = (
                make_blank(self._specimen)
                if tried == KICK_TRIAL
                else find_pinned_wall(self._specimen, level)
            )
        except StateError:  # nothing pins it there
            return UNDECODABLE
        self._element.chain.place(wall)
        self._element.transducer.assume_equilibrium()
        if tried == STEP_TRIAL:
            return self._moved(go_to_level(self._element, level, level + 1))
        if tried == KICK_TRIAL:
            return self._moved(kick(self._element, level))
        return self._decoded(tried)

    def _moved(self, move: Procedure[None]) -> int:
        element, design = self._element, self._element.design
        run(element, move, self._shake)
        run(element, wait(element, SETTLE_DAMPING_TIMES / design.eta), self._shake)
        configuration = element.chain.configuration
        reached = find_level(design, configuration, design.J / 2)
        if reached < 0:
            return UNDECODABLE
        try:
            rest = wall_position(design, find_pinned_wall(self._specimen, reached))
        except StateError:
            return UNDECODABLE
        beside = abs(wall_position(design, configuration) - rest)
        return reached if beside < MAX_ARRIVAL_ERROR_CELLS else UNDECODABLE

    def _try_word(self, word: int, tried: str) -> int:
        """Write or read a word, and return what `try_element` says of it."""
        element = self._element
        levels = element.reader.list_walls(word)
        try:
            v = (
                pin_walls(self._specimen, levels)
                if tried == READ_TRIAL
                else make_blank(self._specimen)
            )
        except StateError:  # nothing pins its walls there
            return UNDECODABLE
        element.chain.place(v)
        element.transducer.assume_equilibrium()
        if tried == READ_TRIAL:
            return self._heard(element.reader.read(element))
        run(element, go_to_level(element, 0, word), self._shake)
        run(element, wait(element, SETTLE_DAMPING_TIMES / element.design.eta), self._shake)
        if tried == BLIND_TRIAL:
            return self._heard(element.reader.read(element))
        found = sorted(
            wall.position for wall in find_walls(element.design, element.chain.configuration)
        )
        return count_astray(element.design, found, levels) or word

    def _decoded(self, end: str) -> int:
        return self._heard(self._element.reader.read(self._element, end))

    def _heard(self, reading: Procedure[Reading]) -> int:
        try:
            return run(self._element, reading, self._shake).level
        except ProcedureFailed:  # it does not come to rest
            self._element.transducer.release()
            return UNDECODABLE

    def _shake(self) -> None:
        """Give the base the acceleration of a tick, if it shakes."""
        if self._vibration:
            drawn = self._vibration * float(self._random.standard_normal())
            self._element.base.disturb(min(max(drawn, -self._limit), self._limit))


def count_astray(design: Design, found: Sequence[float], levels: Sequence[int]) -> int:
    """Return how walls, by position from the left, are not those of a word; 0 if they are."""
    if missing := len(levels) - len(found):
        return ANNIHILATED if missing > 0 and missing % 2 == 0 else LOST
    for position, level in zip(reversed(found), reversed(levels), strict=True):
        if abs(away := position - design.defect_site(level)) > MAX_LEVEL_OFFSET_CELLS:
            return FAR if away > 0.0 else SHORT
    return 0


BATCH_LEVELS = 64
"""Levels per point: several small elements, or one tried at 64 levels."""


def is_screened(shared: Values, kind: str, tried: str) -> bool:
    """Return whether a forecast chooses which trials to simulate."""
    return bool(shared['screen']) and tried == STEP_TRIAL and kind in FORECAST_KINDS


def batch_size(shared: Values, kind: str, tried: str) -> tuple[int, int]:
    """Return the number of elements of a point, and of trials of each; seconds of computing."""
    each = len(expected_outcomes(Design(**shared['design']), tried))
    if shared['levels']:
        each = min(each, shared['levels'])
    return max(1, BATCH_LEVELS // each) * (
        DRAWN_PER_SCREENED if is_screened(shared, kind, tried) else 1
    ), each


@dataclass(frozen=True)
class TriedElement:
    """The trials of one element.

    Attributes:
        seed: Reproduces this element alone.
        levels: The levels stepped from, or read, rising: all, or a random sample; or random words.
        counts: Weight of a failure of each; 0 if the screen left it out.
        found: The results, see `try_element`; the expected one where left out.
        wrong: Whether each result differs from the expected one.
    """

    seed: int
    levels: NDArray[np.int_]
    counts: Array
    found: NDArray[np.int_]
    wrong: NDArray[np.bool_]


def try_elements(shared: Values, values: Values, seed: int) -> Iterator[TriedElement]:
    """Make the elements of a point and try each.

    `shared` is that of `Tolerance`, the seed that of the point.
    """
    design, settings = (
        decode_value(Design, shared['design']),
        decode_value(Settings, shared['settings']),
    )
    kind, tried = values['kind'], values['tried']
    by, all_right = (
        single_chance(kind, values['scatter']),
        np.array(expected_outcomes(design, tried)),
    )
    count, each = batch_size(shared, kind, tried)
    for one in np.random.SeedSequence(seed).generate_state(count, np.uint64).tolist():
        drawing = make_generator(one, Stream.LEVELS)
        if tried in WORD_TRIALS:
            right = levels = drawing.integers(1, count_words(design, settings), each)
        else:
            right = all_right[
                levels := np.sort(drawing.choice(len(all_right), each, replace=False))
            ]
        counts = np.ones(each)
        if is_screened(shared, kind, tried):
            specimen = scattered(design, by.scatter, one)
            counts = draw_weights(_build_forecast(design, settings), specimen, levels, one)
        found = right.copy()
        simulated = counts > 0.0
        if simulated.any():
            try:
                found[simulated] = try_element(
                    design, settings, by, one, tried, levels[simulated].tolist()
                )
            except DesignError:  # a cell so light that the time step is too long for it: all lost
                found[simulated] = UNDECODABLE
        yield TriedElement(one, levels, counts, found, found != right)


def evaluate_point(shared: Values, values: Values, seed: int) -> Row:
    """Return the counts of one point; for the arguments see `try_elements`.

    Returns:
        elements: How many were made.
        simulated: How many trials were simulated.
        squares: Sum over the elements of the square of the number of their failures.
        silent: Reads, of all levels, that were decoded as another level.
        tried_L: Steps from level L, or reads of it; of words all under 0.
        failed_L: How many of them failed, weighted if screened.
        far, short, annihilated, lost: Of words that were written, how; see `ASTRAY_NAMES`.
        undecodable, paired: Of words that were read, how; see `MISREAD_KINDS`.
    """
    many = values['tried'] in WORD_TRIALS
    levels = range(
        1 if many else len(expected_outcomes(Design(**shared['design']), values['tried']))
    )
    tried, failed = np.zeros(len(levels), int), np.zeros(len(levels))
    how = np.zeros(len(ASTRAY_NAMES), int)
    made = simulated = silent = undecodable = paired = 0
    squares = 0.0
    for one in try_elements(shared, values, seed):
        made += 1
        simulated += int(np.count_nonzero(one.counts))
        at = np.zeros_like(one.levels) if many else one.levels
        np.add.at(tried, at, 1)
        np.add.at(failed, at, one.wrong * one.counts)
        how += [int((one.found == each).sum()) for each in ASTRAY_NAMES]
        squares += float(one.wrong @ one.counts) ** 2
        if values['tried'] != STEP_TRIAL:
            silent += int(np.sum(misread := one.wrong & (one.found >= 0)))
        if many:
            undecodable += int(np.sum(one.found == UNDECODABLE))
            paired += _count_paired(shared, one.levels[misread], one.found[misread])
    return {
        'elements': made, 'simulated': simulated, 'squares': squares, 'silent': silent,
        **{f'tried_{level}': int(tried[level]) for level in levels},
        **{f'failed_{level}': float(failed[level]) for level in levels},
        **(dict(zip(ASTRAY_NAMES.values(), how.tolist(), strict=True)) if many else {}),
        **({'undecodable': undecodable, 'paired': paired} if many else {}),
    }  # fmt: skip


def _count_paired(shared: Values, words: NDArray[np.int_], read: NDArray[np.int_]) -> int:
    """Return how many words were read as ones with two walls more or fewer, or six."""
    code = make_code(
        decode_value(Design, shared['design']), decode_value(Settings, shared['settings'])
    )
    assert code is not None
    pairs = zip(words.tolist(), read.tolist(), strict=True)
    return sum((len(code.walls(one)) - len(code.walls(other))) % 4 == 2 for one, other in pairs)


@lru_cache(maxsize=1)
def _build_forecast(design: Design, settings: Settings) -> StepForecast:
    return StepForecast(design, settings)
