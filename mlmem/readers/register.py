# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Many walls in one element: what it answers to a pulse in each word.

Walls and kinks alternate, from the right end on, and rest at levels that are at least
`register.spacing` apart. A pulse whose carrier lies inside both pass bands passes every wall and
brings an echo of each. What both ends do after it is forecast for every word; the nearest forecast
names the word, if what is left is no more than noise.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import ErrorCode, SettingsError
from ..instrument.end import End, Shot
from ..physics import Design, Specimen, StateError, find_walls
from ..physics.equilibrium import DEFECT_OFFSET_CELLS, find_pinned_walls
from ..physics.values import Array
from ..physics.waves import Complex, combine_rows, linearize_cells, multiply_matrices
from ..settings import Settings
from .decoding import explain_no_phase
from .reading import BLANK, UNDECODABLE, Reading, Unclear
from .waveforms import Ends, Listener
from .words import Code, make_code

MAX_LEVEL_OFFSET_CELLS = 2.0
"""Distance in cells up to which a wall rests at the defect of its level."""

MAX_RESIDUAL_RATIO = 0.3
"""What may be left of a waveform when its forecast is taken off, relative to the distance of that
forecast from any other: what explains half of the distance could be another word."""

MAX_OFF_LEVEL_STATES, OFF_LEVEL_SHARE = 96, 0.6
"""Walls that rest elsewhere of which a waveform is forecast; and what may be left at a word,
relative to the least that the nearest word leaves of any of these: others leave a quarter less."""

BATCH_ROWS = 256
"""Forecasts that are compared with all others at a time."""


def pin_walls(made: Specimen, levels: Sequence[int]) -> Array:
    """Return the displacements of an unstrained element with walls and kinks at some levels.

    Raises:
        StateError: They do not rest there.
    """
    design = made.design
    v = find_pinned_walls(
        made, [design.defect_site(level) + DEFECT_OFFSET_CELLS for level in levels]
    )
    if find_wall_levels(design, v) != tuple(sorted(levels)):
        found = sorted(round(wall.position, 2) for wall in find_walls(design, v))
        expected = f'one whose walls rest at its levels; they rest at {found}'
        raise StateError(ErrorCode.UNSUPPORTED, 'content', list(levels), expected)
    return v


def find_wall_levels(design: Design, v: Array) -> tuple[int, ...] | None:
    """Return the levels at which walls and kinks are, the lowest first; None if one is elsewhere,
    or two are at one level.
    """
    found = list[int]()
    for wall in find_walls(design, v):
        level = min(range(design.levels), key=lambda n: abs(design.defect_site(n) - wall.position))
        if (
            abs(design.defect_site(level) - wall.position) > MAX_LEVEL_OFFSET_CELLS
            or level in found
        ):
            return None
        found.append(level)
    return tuple(sorted(found))


def find_off_level_states(made: Specimen, code: Code) -> Iterator[Array]:
    """Yield displacements of an element that rests in no word, at most `MAX_OFF_LEVEL_STATES`: a
    wall of a random word, or one more, is pinned by the lattice between levels, or rests nearer
    to another than words allow.
    """
    design, random = made.design, np.random.default_rng(0)
    for turn in np.linspace(-1.0, design.levels, MAX_OFF_LEVEL_STATES, endpoint=False):
        between = 0.25 + 0.5 * (turn % 1.0)  # nearer to a level it goes there
        place = round(design.defect_site(0) + design.J * (math.floor(turn) + between))
        at = [
            design.defect_site(n) + DEFECT_OFFSET_CELLS
            for n in code.walls(int(random.integers(code.words)))
        ]
        if at and random.integers(2):
            at.remove(min(at, key=lambda each: abs(each - place)))
        with contextlib.suppress(StateError):  # nothing holds it there
            # a wall that is held comes to rest in 40 Newton steps; others slide to a level
            v = find_pinned_walls(made, [*at, place], iterations=40)
            levels = find_wall_levels(design, v)
            if levels is None or not code.is_valid_word(levels):
                yield v


class Content(NamedTuple):
    """What an element may hold: its number, the levels of its walls, and its code."""

    number: int
    walls: tuple[int, ...]
    code: str


def pin_contents(
    made: Specimen, wall_sets: Iterable[tuple[int, ...]]
) -> tuple[list[Content], list[Array]]:
    """Return the contents of one wall that an element holds, blank first, and the displacements.

    Several walls are no content. Sets of walls that do not rest at their levels are left out:
    walls so near each other annihilate, and nothing may pin one beside a bad cell.
    """
    contents, states = [Content(BLANK, (), '')], [pin_walls(made, ())]
    for walls in wall_sets:
        with contextlib.suppress(StateError):
            states.append(pin_walls(made, walls))
            alone = len(walls) == 1
            number, code = (walls[0], made.design.code(walls[0])) if alone else (UNDECODABLE, '')
            contents.append(Content(number, walls, code))
    return contents, states


@dataclass(eq=False, repr=False)
class Forecasts:
    """What both ends do after the pulse of a read, by content.

    Attributes:
        contents: What the element may hold, one a row of `parts`.
        parts: In the band, shape (contents, 4 lines); see `Listener`.
        listener: Makes parts.
        end: The end that fires the pulse.
        lost: Why a content cannot be used, by its number.
        limits: The same in words; empty if no cell is known to be bad.
        hidden_part: The forecasts of the part that a stuck cell hides from the pulse, or None.
    """

    contents: Sequence[Content]
    parts: Array
    listener: Listener
    end: End = End.LEFT
    lost: Mapping[int, str] = field(default_factory=dict)
    limits: str = ''
    hidden_part: Forecasts | None = None

    def __post_init__(self) -> None:
        self._square = np.square(self.parts).sum(axis=1)
        self.odd = np.array([len(each.walls) % 2 for each in self.contents])

    @cached_property
    def nearest_distances(self) -> Array:
        """Distance of every part to the nearest one with the same phase at the left end, shape
        (contents,); at most the pulse, as far as the blank element answers it.
        """
        found, pulse = np.empty(len(self.parts)), self.pulse_size
        for odd in (0, 1):
            same = np.flatnonzero(self.odd == odd)
            parts = (self.parts[same] - self.parts[0]).astype(np.float32)
            square = np.square(parts).sum(axis=1)
            for at in range(0, len(same), BATCH_ROWS):
                these = slice(at, at + BATCH_ROWS)
                apart = square[these, None] + square - 2.0 * parts[these] @ parts.T
                itself = np.arange(at, at + len(apart))[:, None]
                np.put_along_axis(apart, itself, np.inf, axis=1)
                # Find the distance of the nearest four again in double precision: in single
                # precision it depends on the order of sums, and so on the BLAS, by 3e-5.
                refined = 4
                near = np.argpartition(apart, min(refined, len(same)) - 1)[:, :refined]
                ways = np.linalg.norm(self.parts[same[near]] - self.parts[same[itself]], axis=2)
                ways = np.where(near == itself, pulse, ways)
                found[same[these]] = ways.min(axis=1, initial=pulse)
        return found

    @property
    def pulse_size(self) -> float:
        """The size of what the blank element answers, in the unit of `parts`."""
        return float(np.linalg.norm(self.parts[0]))

    @property
    def least_distance(self) -> float:
        """The least distance between contents that are distinguished."""
        return float(self.nearest_distances.min())

    @cached_property
    def max_noise(self) -> float:
        """Noise (`Listener.noise`) up to which every content is distinguished from all others."""
        distance = self.least_distance
        # the noise during a read may be twice that before it
        return MAX_RESIDUAL_RATIO * MAX_RESIDUAL_RATIO * distance * distance / 2.0

    def find_nearest(self, part: Array, phase: int) -> tuple[int, float, float]:
        """Return the row of the content nearest to a part with a phase at the left end, what
        remains of the part when its forecast is taken off, and how far the part is on the way to
        any other forecast: 0 at its own, 1 at the other.
        """
        same = self.odd == phase
        left = np.where(same, self._square - 2.0 * self.parts @ part, np.inf)
        row = int(np.argmin(left))
        forecast = self.parts[row]
        off = part - forecast
        same[row] = False
        apart = (self._square - 2.0 * self.parts @ forecast + self._square[row])[same]
        along = (self.parts @ off - forecast @ off)[same] / np.maximum(apart, 1e-30)
        return row, float(np.linalg.norm(off)), float(along.max(initial=0.0))

    def decode(
        self, shot: Shot, noise: float, phases: Sequence[int | None], least: float
    ) -> Reading:
        """Return the content of what both ends did after a pulse, given the noise before and the
        phases of the ends.

        The nearest forecast must leave no more than `MAX_RESIDUAL_RATIO` of its distance to any
        other, and `least` is the least margin in the direction of any: 1 at the forecast, 0
        half-way. So an error at one end or at both, of any shape, that is smaller than half the
        difference of two words changes none; a greater one is the difference of two words, or is
        refused.
        """
        nothing = Reading(UNDECODABLE, '', self.end.value, None, 0.0, 0.0, math.inf)
        try:
            check_readable(shot, noise > self.max_noise, phases)
            part = self.listener.project_shot(shot)
            row, left, along = self.find_nearest(part, phases[End.LEFT.row] or 0)
            threshold_margin = self._judge_residual(part, row, left)
            margin, content = round(1.0 - 2.0 * along, 6), self.contents[row]
            if margin < least:
                raise Unclear(f'what is heard lies between two contents (margin {margin:.2f})')
        except Unclear as unclear:
            return replace(nothing, reason=str(unclear), walls=unclear.walls)
        return replace(
            nothing, level=content.number, code=content.code, level_margin=margin,
            threshold_margin=round(threshold_margin, 6), walls=len(content.walls),
        )  # fmt: skip

    def _judge_residual(self, part: Array, row: int, left: float) -> float:
        """Return the threshold margin of a part, given what its nearest content leaves of it.

        Raises:
            Unclear: It is not of that content.
        """
        allowed = MAX_RESIDUAL_RATIO * float(self.nearest_distances[row])
        if left > allowed:
            raise Unclear(
                f'the nearest forecast, of {self.contents[row].number}, leaves '
                f'{left / allowed:.3g} times what it may: a wall is between levels, or something '
                'else answers, or there is noise'
            )
        return allowed / max(left, 1e-3 * allowed)


def check_readable(shot: Shot, noisy: bool, phases: Sequence[int | None]) -> None:
    """Raise `Unclear` if what the ends did tells nothing, whatever it was.

    `noisy` says that there was too much noise before.
    """
    if reason := explain_no_phase(phases):
        raise Unclear(reason)
    if phases[End.RIGHT.row] == 1:
        raise Unclear('the right end is active: a wall has left the element')
    if not np.isfinite(shot.samples).all():
        raise Unclear('listening was interrupted')
    if noisy:
        raise Unclear('the ends move too much to hear every wall')


@dataclass(eq=False, repr=False)
class Register(Forecasts):
    """What both ends do by word.

    Attributes:
        code: The words.
    """

    code: Code = field(kw_only=True)

    def tighten_limits(self, parts: Array, odd: Array) -> None:
        """Tighten the residual limits so that no off-level state decodes as a word.

        Args:
            parts: Forecasts of walls that are elsewhere, shape (m, 4 lines).
            odd: Whether there is an odd number of them, shape (m,).
        """
        least = MAX_RESIDUAL_RATIO / OFF_LEVEL_SHARE
        for phase in (0, 1):
            words, these = np.flatnonzero(self.odd == phase), parts[odd == phase]
            left = self._square[words] - 2.0 * these @ self.parts[words].T
            nearest = words[left.argmin(axis=1)]
            off = np.linalg.norm(these - self.parts[nearest], axis=1)
            least = (off / self.nearest_distances[nearest]).min(initial=least)
        self.nearest_distances = self.nearest_distances * (
            least * OFF_LEVEL_SHARE / MAX_RESIDUAL_RATIO
        )


def forecast_words(made: Specimen, settings: Settings) -> Register:
    """Return the forecasts of an element in every word.

    Raises:
        SettingsError: The element holds one wall, or walls of a word do not rest at their levels.
    """
    code = make_code(made.design, settings)
    if code is None:
        raise SettingsError(ErrorCode.CONFLICT, 'register.spacing', 0, 'above 0 for a register')
    listener = Listener(settings)
    ends = Ends(made, settings, listener)
    parts = np.concatenate(
        [
            ends.compute_parts(combine_rows(*each))
            for each in _build_word_parts(made, code, ends.tones.square, ends.tones.loss)
        ]
    )
    words = range(code.words)
    contents = [Content(word, code.walls(word), code.format_binary(word)) for word in words]
    found = Register(contents, parts, listener, code=code)
    if others := list(find_off_level_states(made, code)):
        active = np.stack(others)[:, [0, -1]] > made.design.D_barrier
        found.tighten_limits(ends.compute_answers(made, others), active[:, 0] != active[:, 1])
    return found


def _number_surroundings(made: Design, code: Code) -> NDArray[np.int64]:
    """Return a number for every word and level that says which walls are near, and in which
    phase, shape (words, levels): the same number, the same cells of this level.

    Walls are near within 30 cells of the middle between this level and the next: a wall ends as
    exp(-0.5 distance).
    """
    near = math.ceil(30.0 / made.J - 0.5)
    walls = np.zeros((code.words, code.levels), dtype=np.bool_)
    for word in range(code.words):
        walls[word, list(code.walls(word))] = True
    behind = np.cumsum(walls[:, ::-1], axis=1)[:, ::-1] % 2
    padded = np.pad(walls, ((0, 0), (near, near))).astype(np.int64)
    found = np.pad(behind, ((0, 0), (0, near + 1)))[:, near + 1 :].astype(np.int64)
    for k in range(2 * near + 1):
        found = 2 * found + padded[:, k : k + code.levels]
    return np.asarray(found * code.levels + np.arange(code.levels))


def _build_word_parts(
    made: Specimen, code: Code, square: Complex, loss: Complex
) -> Iterator[tuple[Complex, NDArray[np.int64]]]:
    """Yield the matrices of the levels' cells, and of which the words consist, `BATCH_ROWS` at a
    time.

    A word whose every level has been seen with the same surroundings needs no equilibrium of its
    own.
    """
    design = made.design
    around, chosen = np.unique(_number_surroundings(design, code), return_inverse=True)
    chosen = chosen.reshape(code.words, code.levels)
    edges = [0, *(design.defect_site(n) + design.J // 2 for n in range(code.levels - 1)), design.N]
    matrices = np.empty((len(around), len(square), 2, 2), dtype=np.complex128)
    known = np.zeros(len(around), dtype=np.bool_)
    for word in np.random.default_rng(0).permutation(code.words):
        if known[chosen[word]].all():
            continue
        try:
            v = pin_walls(made, code.walls(int(word)))
        except StateError as error:
            expected = 'one whose walls rest at its levels'
            raise SettingsError(ErrorCode.UNSUPPORTED, 'word', int(word), expected) from error
        stiffness, mass, spring = linearize_cells(made, v)
        for level, number in enumerate(chosen[word]):
            if not known[number]:
                part = slice(edges[level], edges[level + 1])
                matrices[number] = multiply_matrices(
                    stiffness[part], mass[part], spring[part], square, loss
                )
        known[chosen[word]] = True
    for at in range(0, code.words, BATCH_ROWS):
        yield matrices, chosen[at : at + BATCH_ROWS]
