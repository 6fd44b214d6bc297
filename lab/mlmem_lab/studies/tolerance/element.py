# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One random element: every level is read from an end, or every step up is tried once; of many
walls, some random words are written or read.

Each level is tried on its own: the wall is put where it rests in this element (by Newton's
method), and read, or driven on by a write of the next level; or a word is kicked into the blank
element, or put at rest and read. So one element samples every step or read, and a failed step does
not spoil the others.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mlmem import UNDECODABLE, Faults, MemoryElement, SetFaults
from mlmem.errors import ProcedureFailed
from mlmem.instrument.blocks import Procedure, run, wait
from mlmem.moves.kick import kick_speed, kick_to
from mlmem.physics import (
    Design,
    DesignError,
    Scatter,
    Specimen,
    StateError,
    draw_specimen,
    find_level,
    find_walls,
)
from mlmem.physics.equilibrium import find_pinned_wall, make_blank
from mlmem.procedures.writing import go_to_level
from mlmem.readers.reading import Reading
from mlmem.readers.register import MAX_LEVEL_OFFSET_CELLS, pin_walls
from mlmem.readers.words import count_words
from mlmem.rng import RandomStream, make_generator
from mlmem.settings import Settings

from ..trace import wall_position

Row = dict[str, Any]
"""What was counted of an amount: the amount, and the sums of `evaluate_batch`."""

STEP_TRIAL, KICK_TRIAL, WORD_TRIAL, READ_TRIAL = 'step', 'kick', 'word', 'hear'

WORD_TRIALS = WORD_TRIAL, READ_TRIAL

TRIAL_LABELS = {
    STEP_TRIAL: 'step up', 'left': 'read from the left', 'right': 'read from the right',
    KICK_TRIAL: 'kick', WORD_TRIAL: 'word written', READ_TRIAL: 'word read',
}  # fmt: skip
"""What may be tried: a step up, or a read from an end; a kick from the blank element to a level,
with the speed of the ideal one; of many walls, a random word that is kicked into the blank element
and not verified, or one that rests and is read in one pulse."""

GLOBAL_KINDS = 'noise', 'vibration', 'damping', 'gain'
"""What may be random of the whole, as standard deviations: of the transducers' signals, in cells;
of the base's acceleration, in lattice constants per time unit squared, drawn anew for every tick
of the instrument and linear between; of the damping and of the transducers' gain, relative."""

ALL_KINDS = (*(one.name for one in dataclasses.fields(Scatter)), *GLOBAL_KINDS)
"""Names of what may be random: the scatters of the fabrication, and these."""


def split_kinds(kind: str) -> list[str]:
    """Return the kinds that are random at once, by the same amount: of `alpha+k_r+mass` three."""
    return kind.split('+')


def count_trials(design: Design, tried: str) -> int:
    """Return how many trials are made of an element."""
    if tried in WORD_TRIALS:
        return 8
    return design.levels - (tried == STEP_TRIAL)


def count_elements(design: Design, tried: str) -> int:
    """Return how many elements a batch of 64 trials has, at least one: seconds of computing."""
    return max(1, 64 // count_trials(design, tried))


def try_element(
    design: Design,
    settings: Settings,
    by: Mapping[str, float],
    seed: int,
    tried: str,
    given: Sequence[int],
) -> tuple[int, ...]:
    """Make a random element and try its steps up, its kicks, or its reads from an end.

    It is read with the calibration of the ideal element.

    Args:
        by: Amounts of what is random, by their kinds.
        seed: Of the element: the same gives the same outcome.
        tried: `STEP_TRIAL`, `KICK_TRIAL`, one of `WORD_TRIALS`, or the end that is read from.
        given: The levels to step from, to kick to or to read, or the words.

    Returns:
        For each of these the level to which a write of the next one took the wall, the level where
        a kick ended, the decoded level, or the word. `UNDECODABLE` if the element pins no wall at
        the level, if a move does not end with exactly one wall at rest at a level, or if the walls
        are not those of the word.

    Raises:
        DesignError: The element cannot be simulated with the step of the ideal one.
    """
    noise, vibration, damping, gain = (by.get(name, 0.0) for name in GLOBAL_KINDS)
    if tried != STEP_TRIAL and not vibration:
        # a long tick rounds waits up, and does not change the material
        time = dataclasses.replace(settings.time, tick=100.0)
        settings = dataclasses.replace(settings, time=time)
    element = MemoryElement(design, settings)
    off = make_generator(seed, RandomStream.GAIN).standard_normal(2) * (damping, gain)
    faults = Faults(sensor_noise=noise, sensor_gain=float(1.0 + off[1]), seed=seed % 2**31)
    element.apply(SetFaults(faults))
    scatter = Scatter(**{name: by[name] for name in by.keys() - GLOBAL_KINDS})
    specimen = draw_specimen(design, scatter, seed)
    specimen = dataclasses.replace(specimen, eta_factor=max(float(1.0 + off[0]), 0.0))
    element.chain.set_specimen(specimen)
    made = _Made(element, specimen, vibration, seed)
    return tuple(made.outcome(each, tried) for each in given)


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

    def outcome(self, given: int, tried: str) -> int:
        """Put the walls where they begin, and return what `try_element` says of it."""
        element = self._element
        levels = element.reader.list_walls(given) if tried in WORD_TRIALS else ()
        try:
            if tried in (KICK_TRIAL, WORD_TRIAL):
                v = make_blank(self._specimen)
            elif tried == READ_TRIAL:
                v = pin_walls(self._specimen, levels)
            else:
                v = find_pinned_wall(self._specimen, given)
        except StateError:  # nothing pins it there
            return UNDECODABLE
        element.chain.place(v)
        element.transducer.assume_equilibrium()
        if tried == STEP_TRIAL:
            return self._find_moved(go_to_level(element, given, given + 1))
        if tried == KICK_TRIAL:
            speed = kick_speed(element.design, element.settings, given)
            return self._find_moved(kick_to(element, element.design.D_s2, speed))
        if tried == READ_TRIAL:
            return self._decode(element.reader.read(element))
        if tried == WORD_TRIAL:
            return given if self._is_written(go_to_level(element, 0, given), levels) else -2
        return self._decode(element.reader.read(element, tried))

    def _settle(self, move: Procedure[None]) -> None:
        run(self._element, move, self._shake)
        # the gradient may still roll the wall to its defect for two damping times
        rest = wait(self._element, 5.0 / self._element.design.eta)
        run(self._element, rest, self._shake)

    def _find_moved(self, move: Procedure[None]) -> int:
        self._settle(move)
        design, configuration = self._element.design, self._element.chain.configuration
        reached = find_level(design, configuration, design.J / 2)
        if reached < 0:
            return UNDECODABLE
        try:
            rest = wall_position(design, find_pinned_wall(self._specimen, reached))
        except StateError:
            return UNDECODABLE
        # a wall that stops on its way reads as the nearest level, but the next cycle starts at the
        # wrong place
        has_arrived = abs(wall_position(design, configuration) - rest) < 1.0
        return reached if has_arrived else UNDECODABLE

    def _is_written(self, move: Procedure[None], levels: Sequence[int]) -> bool:
        self._settle(move)
        design = self._element.design
        found = sorted(
            wall.position for wall in find_walls(design, self._element.chain.configuration)
        )
        return len(found) == len(levels) and all(
            abs(position - design.defect_site(level)) <= MAX_LEVEL_OFFSET_CELLS
            for position, level in zip(found, levels, strict=True)
        )

    def _decode(self, reading: Procedure[Reading]) -> int:
        try:
            return run(self._element, reading, self._shake).level
        except ProcedureFailed:  # it does not come to rest
            self._element.transducer.release_ends()
            return UNDECODABLE

    def _shake(self) -> None:
        """Give the base the acceleration of a tick, if it shakes."""
        if self._vibration:
            drawn = self._vibration * float(self._random.standard_normal())
            self._element.base.accept_acceleration(min(max(drawn, -self._limit), self._limit))


def evaluate_batch(
    design: Design, settings: Settings, kind: str, tried: str, amount: float, seed: int
) -> dict[str, int]:
    """Return the counts of a batch of elements with one kind of randomness.

    Returns:
        elements, trials, failures: How many.
        squares: Sum over the elements of the square of the number of their failures.
    """
    each, by = count_trials(design, tried), dict.fromkeys(split_kinds(kind), amount)
    counts = dict.fromkeys(('elements', 'trials', 'failures', 'squares'), 0)
    seeds = np.random.SeedSequence(seed).generate_state(count_elements(design, tried), np.uint64)
    for one in seeds.tolist():
        given = np.arange(each)
        if tried in WORD_TRIALS:
            drawing = make_generator(one, RandomStream.LEVELS)
            given = drawing.integers(1, count_words(design, settings), each)
        try:
            found = np.array(try_element(design, settings, by, one, tried, given.tolist()))
        except DesignError:  # a cell so light that the time step is too long for it: all lost
            found = np.full(each, UNDECODABLE)
        wrong = found != given + (tried == STEP_TRIAL)
        failures = int(wrong.sum())
        counts['elements'] += 1
        counts['trials'] += each
        counts['failures'] += failures
        counts['squares'] += failures**2
    return counts
