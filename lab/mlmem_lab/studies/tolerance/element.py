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
from mlmem.parsing import decode
from mlmem.physics import (
    Design,
    DesignError,
    Scatter,
    Specimen,
    StateError,
    find_walls,
    level_of,
    scattered,
)
from mlmem.physics.equilibrium import blank, resting_wall
from mlmem.physics.potential import Array
from mlmem.procedures import run
from mlmem.procedures.blocks import Procedure, kick, wait
from mlmem.procedures.driving import go_to_level
from mlmem.procedures.listening import hear, look
from mlmem.procedures.many_walls import put
from mlmem.readers.reading import Reading
from mlmem.readers.register import NEAR, resting
from mlmem.readers.words import code_of, words_of
from mlmem.rng import Stream, generator
from mlmem.settings import Settings

from ..bench import Bench
from ..campaign import Row
from ..campaign.campaign import Values
from ..trace import wall_position
from .particle import DRAWN, FORESEEN, StepForecast, weights

SETTLED = 5.0
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


STEP = 'step'
"""What is tried: a step up. A read is named by its end."""

KICK = 'kick'
"""Also: a kick from the blank element to a level, with the speed of the ideal one."""

WORD = 'word'
"""Of many walls: a random word is kicked into the blank element, and not verified."""

HEAR = 'hear'
"""Of many walls: a random word that rests is read in one pulse."""

BLIND = 'blind'
"""Of many walls: as `WORD`, then read: what a word is that nobody verified."""

OF_WORDS = WORD, HEAR, BLIND

FAR, SHORT, ANNIHILATED, LOST = -3, -4, -5, -6
"""How a word fails, by the first wall, from the right, that is not at its level: it ran on, or
stopped before; or an even number of walls is missing, or anything else happened."""

ASTRAY = {FAR: 'far', SHORT: 'short', ANNIHILATED: 'annihilated', LOST: 'lost'}
"""Their names."""

MISREAD = 'undecodable', 'silent', 'paired'
"""How a read of a word fails: it tells nothing, or another word, which may have two walls more or
fewer, or six: where a wall and a kink meet, both are gone.
"""

WORDS = 8
"""Words that are tried in each element."""

ARRIVED = 1.0
"""Distance in cells from its rest position in this element within which a wall has arrived. One
that stops on its way reads as the nearest level, but the next cycle starts at the wrong place."""

OF_ALL = 'noise', 'vibration', 'damping', 'gain'

KINDS = (*(one.name for one in dataclasses.fields(Scatter)), *OF_ALL)
"""Names of what may be random."""


def chance(kind: str, amount: float) -> Chance:
    """Return randomness of one kind only."""
    changed: dict[str, Any] = {kind: amount}
    return Chance(**changed) if kind in OF_ALL else Chance(Scatter(**changed))


def wanted(design: Design, tried: str) -> tuple[int, ...]:
    """Return what `outcomes` gives for an ideal element; of words, for which each is its own
    answer, so many numbers.
    """
    if tried in OF_WORDS:
        return tuple(range(WORDS))
    return tuple(range(1, design.levels) if tried == STEP else range(design.levels))


def outcomes(
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
        tried: `STEP`, `KICK`, one of `OF_WORDS`, or the end that is read from.
        levels: The levels to step from or to read, or the words; by default all levels.

    Returns:
        For every one of these levels the level to which a write of the next one took the wall, or
        for a kick the level where it ended, or for reads the decoded level. `UNDECODABLE` if the
        element pins no wall at the level, and for steps and kicks unless exactly one wall ends at
        rest at a level. A word that was not written is one of `ASTRAY`.

    Raises:
        DesignError: The element cannot be simulated with the step of the ideal one.
    """
    if tried != STEP and not by.vibration:
        settings = dataclasses.replace(
            settings, time=dataclasses.replace(settings.time, tick=LONG_TICK)
        )
    element = Bench(design, settings).device()
    damping, gain = 1.0 + generator(seed, Stream.GAIN).standard_normal(2) * (by.damping, by.gain)
    faults = Faults(sensor_noise=by.noise, sensor_gain=float(gain), seed=seed % 2**31)
    element.apply(SetFaults(faults))
    specimen = scattered(design, by.scatter, seed)
    specimen = dataclasses.replace(specimen, eta_factor=max(float(damping), 0.0))
    element.chain.set_specimen(specimen)
    made = _Made(element, specimen, by.vibration, seed)
    levels = range(len(wanted(design, tried))) if levels is None else levels
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
        """Put the wall at rest at a level, and return what `outcomes` says of it."""
        if tried in OF_WORDS:
            return self._word(level, tried)
        try:
            wall = blank(self._specimen) if tried == KICK else resting_wall(self._specimen, level)
        except StateError:  # nothing pins it there
            return UNDECODABLE
        self._element.chain.place(wall)
        self._element.transducer.assume_rest()
        if tried == STEP:
            return self._moved(go_to_level(self._element, level, level + 1))
        if tried == KICK:
            return self._moved(kick(self._element, level))
        return self._decoded(tried)

    def _moved(self, move: Procedure[None]) -> int:
        element, design = self._element, self._element.design
        run(element, move, self._shake)
        run(element, wait(element, SETTLED / design.eta), self._shake)
        configuration = element.chain.configuration
        reached = level_of(design, configuration, design.J / 2)
        if reached < 0:
            return UNDECODABLE
        try:
            rest = wall_position(design, resting_wall(self._specimen, reached))
        except StateError:
            return UNDECODABLE
        beside = abs(wall_position(design, configuration) - rest)
        return reached if beside < ARRIVED else UNDECODABLE

    def _word(self, word: int, tried: str) -> int:
        """Write or read a word, and return what `outcomes` says of it."""
        element, register = self._element, self._element.register
        assert register is not None
        levels = register.code.walls(word)
        try:
            v = resting(self._specimen, levels) if tried == HEAR else blank(self._specimen)
        except StateError:  # nothing pins its walls there
            return UNDECODABLE
        element.chain.place(v)
        element.transducer.assume_rest()
        if tried == HEAR:
            return self._heard(hear(element))
        run(element, put(element, register, 0, word), self._shake)
        run(element, wait(element, SETTLED / element.design.eta), self._shake)
        if tried == BLIND:
            return self._heard(hear(element))
        found = sorted(
            wall.position for wall in find_walls(element.design, element.chain.configuration)
        )
        return astray(element.design, found, levels) or word

    def _decoded(self, end: str) -> int:
        return self._heard(look(self._element, end))

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


def astray(design: Design, found: Sequence[float], levels: Sequence[int]) -> int:
    """Return how walls, by position from the left, are not those of a word; 0 if they are."""
    if missing := len(levels) - len(found):
        return ANNIHILATED if missing > 0 and missing % 2 == 0 else LOST
    for position, level in zip(reversed(found), reversed(levels), strict=True):
        if abs(away := position - design.defect(level)) > NEAR:
            return FAR if away > 0.0 else SHORT
    return 0


BATCH = 64
"""Levels per point: several small elements, or one tried at 64 levels."""


def screened(shared: Values, kind: str, tried: str) -> bool:
    """Return whether a forecast chooses which trials to simulate."""
    return bool(shared['screen']) and tried == STEP and kind in FORESEEN


def size(shared: Values, kind: str, tried: str) -> tuple[int, int]:
    """Return the number of elements of a point, and of trials of each; seconds of computing."""
    each = len(wanted(Design(**shared['design']), tried))
    if shared['levels']:
        each = min(each, shared['levels'])
    return max(1, BATCH // each) * (DRAWN if screened(shared, kind, tried) else 1), each


@dataclass(frozen=True)
class TriedElement:
    """The trials of one element.

    Attributes:
        seed: Reproduces this element alone.
        levels: The levels stepped from, or read, rising: all, or a random sample; or random words.
        counts: Weight of a failure of each; 0 if the screen left it out.
        found: The results, see `outcomes`; the expected one where left out.
        wrong: Whether each result differs from the expected one.
    """

    seed: int
    levels: NDArray[np.int_]
    counts: Array
    found: NDArray[np.int_]
    wrong: NDArray[np.bool_]


def elements(shared: Values, values: Values, seed: int) -> Iterator[TriedElement]:
    """Make the elements of a point and try each.

    `shared` is that of `Tolerance`, the seed that of the point.
    """
    design, settings = decode(Design, shared['design']), decode(Settings, shared['settings'])
    kind, tried = values['kind'], values['tried']
    by, all_right = chance(kind, values['scatter']), np.array(wanted(design, tried))
    count, each = size(shared, kind, tried)
    for one in np.random.SeedSequence(seed).generate_state(count, np.uint64).tolist():
        drawing = generator(one, Stream.LEVELS)
        if tried in OF_WORDS:
            right = levels = drawing.integers(1, words_of(design, settings), each)
        else:
            right = all_right[
                levels := np.sort(drawing.choice(len(all_right), each, replace=False))
            ]
        counts = np.ones(each)
        if screened(shared, kind, tried):
            specimen = scattered(design, by.scatter, one)
            counts = weights(_forecast(design, settings), specimen, levels, one)
        found = right.copy()
        simulated = counts > 0.0
        if simulated.any():
            try:
                found[simulated] = outcomes(
                    design, settings, by, one, tried, levels[simulated].tolist()
                )
            except DesignError:  # a cell so light that the time step is too long for it: all lost
                found[simulated] = UNDECODABLE
        yield TriedElement(one, levels, counts, found, found != right)


def evaluate(shared: Values, values: Values, seed: int) -> Row:
    """Return the counts of one point; for the arguments see `elements`.

    Returns:
        elements: How many were made.
        simulated: How many trials were simulated.
        squares: Sum over the elements of the square of the number of their failures.
        silent: Reads, of all levels, that were decoded as another level.
        tried_L: Steps from level L, or reads of it; of words all under 0.
        failed_L: How many of them failed, weighted if screened.
        far, short, annihilated, lost: Of words that were written, how; see `ASTRAY`.
        undecodable, paired: Of words that were read, how; see `MISREAD`.
    """
    many = values['tried'] in OF_WORDS
    levels = range(1 if many else len(wanted(Design(**shared['design']), values['tried'])))
    tried, failed = np.zeros(len(levels), int), np.zeros(len(levels))
    how = np.zeros(len(ASTRAY), int)
    made = simulated = silent = undecodable = paired = 0
    squares = 0.0
    for one in elements(shared, values, seed):
        made += 1
        simulated += int(np.count_nonzero(one.counts))
        at = np.zeros_like(one.levels) if many else one.levels
        np.add.at(tried, at, 1)
        np.add.at(failed, at, one.wrong * one.counts)
        how += [int((one.found == each).sum()) for each in ASTRAY]
        squares += float(one.wrong @ one.counts) ** 2
        if values['tried'] != STEP:
            silent += int(np.sum(misread := one.wrong & (one.found >= 0)))
        if many:
            undecodable += int(np.sum(one.found == UNDECODABLE))
            paired += _paired(shared, one.levels[misread], one.found[misread])
    return {
        'elements': made, 'simulated': simulated, 'squares': squares, 'silent': silent,
        **{f'tried_{level}': int(tried[level]) for level in levels},
        **{f'failed_{level}': float(failed[level]) for level in levels},
        **(dict(zip(ASTRAY.values(), how.tolist(), strict=True)) if many else {}),
        **({'undecodable': undecodable, 'paired': paired} if many else {}),
    }  # fmt: skip


def _paired(shared: Values, words: NDArray[np.int_], read: NDArray[np.int_]) -> int:
    """Return how many words were read as ones with two walls more or fewer, or six."""
    code = code_of(decode(Design, shared['design']), decode(Settings, shared['settings']))
    assert code is not None
    pairs = zip(words.tolist(), read.tolist(), strict=True)
    return sum((len(code.walls(one)) - len(code.walls(other))) % 4 == 2 for one, other in pairs)


@lru_cache(maxsize=1)
def _forecast(design: Design, settings: Settings) -> StepForecast:
    return StepForecast(design, settings)
