# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reading a long register from both ends inward, level by level.

About an element at rest waves are linear. What an end does after its pulse says how its first
cell moves and with which force, tone by tone (`physics.waves`); the matrices of the cells that are
known carry both inward, to where the cells are not known yet. There the ratio of force to
displacement says what the rest reflects. The first waves to come back tell the next levels: of all
ways to fill these one must fit, and every other that decides the next level otherwise must be far.
(Layer peeling: Bruckstein and Kailath 1987, SIAM Review 29, 359.)

The left end says the left half, the right end the right one, and both some levels in the middle.
In the end the forecast for the whole word must fit all that was recorded better than any
neighbour.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache, lru_cache
from typing import NamedTuple

import numpy as np

from ..physics import Design, Specimen
from ..physics.potential import Array
from ..physics.waves import Complex, carried, group_velocity, passing, product, reflected
from .end import End, Shot
from .errors import SettingsError
from .reading import UNDECODABLE, Reading
from .register import LEFT_OVER, NOISE, Register, forecasts_of, unheard
from .settings import Settings
from .waveforms import AROUND, Cells, Ends, Listener
from .words import Code, code_of

AHEAD = 8
"""Levels that are filled in all ways at a time."""

HEARD = 5.0
"""Levels whose echoes are compared: those of what lies beyond `AHEAD` come later."""

BOTH = 4
"""Levels beyond the middle that an end tells: about twice as many are told by both."""

FAINT = 60.0
"""Time before an echo from which on it is heard, over that in which it rises."""


class Told(NamedTuple):
    """What an end told.

    Attributes:
        walls: Levels of walls, the nearest first, among those that are known.
        known: How many levels are known, from this end on.
        left: What remained at each of these over the distance to the next other decision.
    """

    walls: list[int]
    known: int
    left: list[float]


class Side:
    """What an end hears; levels, cells and walls are counted from it."""

    def __init__(
        self, end: End, inside: Cells, code: Code, ends: Ends, settings: Settings
    ) -> None:
        """Prepare for an end of an element."""
        self.end, self._inside, self._code, self._ends = end, inside, code, ends
        made, self._design = inside.made, inside.design
        design, back = self._design, end is End.RIGHT
        self._back = int(back)
        middles = [design.defect(level) + design.J // 2 + 1 for level in range(code.levels - 1)]
        edges = [0, *middles, design.N]
        self._edges = [design.N - each for each in reversed(edges)] if back else edges
        defects = np.array([design.defect(self.own(level)) for level in range(code.levels)])
        self._sites = design.N - defects if back else defects
        self._mass = np.ascontiguousarray(made.masses[:: -1 if back else 1])
        self._spring = np.append(made.k_r[:: -1 if back else 1], 1.0)
        probe, tones = settings.register.probe, ends.tones
        away = (tones.omega.real - probe.omega_c) * probe.sigma
        weight = np.exp(-0.5 * away * away)
        speeds = [group_velocity(probe.omega_c, k) for k in (design.k_s1, design.k_s2)]
        level = 2.0 * design.J / float(min(speeds))
        first = 2.0 * (self._edges[1] - design.J) / float(min(speeds))
        self._echo, self._first = (
            (weight[:, None] / weight.sum())
            * np.exp(1j * np.outer(tones.omega, np.arange(-FAINT, until, 0.3 * probe.sigma)))
            for until in (HEARD * level, HEARD * level + first)
        )
        self._away = cache(self._waves)

    def own(self, level: int) -> int:
        """Return a level as counted from the other end: its own inverse."""
        return self._code.levels - 1 - level if self.end is End.RIGHT else level

    def _stiffness(
        self, words: Sequence[Sequence[int]], phase: int, first: int, last: int
    ) -> Array:
        """Return the stiffness of the cells of some levels in some words, from this end on.

        Args:
            words: Levels of all walls, from this end on.
            phase: Phase of this end.
            first: First level.
            last: The level after the last one.
        """
        at = np.arange(self._edges[first], self._edges[last])
        phases = np.empty((len(words), len(at)), dtype=np.int64)
        near, reach = list[list[tuple[int, int]]](), self._inside.reach
        for number, walls in enumerate(words):
            sites = self._sites[list(walls)]
            phases[number] = (phase + np.searchsorted(sites, at, side='right')) % 2
            low, high = np.searchsorted(sites, (at[0] - reach, at[-1] + 1 + reach))
            kinds = (phase + self._back + 1 + np.arange(low, high)) % 2
            near.append(list(zip(map(self.own, walls[low:high]), kinds, strict=True)))
        if self._back:
            N = self._design.N
            part = slice(N - 1 - at[-1], N - at[0])
            return self._inside.stiffness(part, near, phases[:, ::-1])[:, ::-1]
        return self._inside.stiffness(slice(at[0], at[-1] + 1), near, phases)

    def _others(self, first: int, last: int) -> tuple[Array, Array, Complex, Complex]:
        """Return what else `waves.carried` takes of the cells of some levels."""
        part, tones = slice(self._edges[first], self._edges[last]), self._ends.tones
        return self._mass[part], self._spring[part], tones.square, tones.loss

    def matrix(self, walls: Sequence[int], phase: int, first: int, last: int) -> Complex:
        """Return the matrix of the cells of some levels, shape (F, 2, 2); see `_stiffness`."""
        return product(self._stiffness([walls], phase, first, last)[0], *self._others(first, last))

    def told(self, motion: Array, dt: float, phase: int, upto: int) -> Told:
        """Return the walls at the first levels, as far as they can be told.

        Args:
            motion: Of this end after its pulse, about its rest, shape (n,).
            dt: Time between samples.
            phase: Phase of this end.
            upto: How many levels to tell.
        """
        u, T = self._ends.tones_of(motion, dt), np.empty(0, dtype=np.complex128)
        walls, shares, here = list[int](), list[float](), phase
        for level in range(upto):
            ways = list(self._ways(level, walls))
            decided, ahead = [level in way for way in ways], min(level + AHEAD, self._code.levels)
            if level == 0 or any(decided):
                answers = self._answers([walls + way for way in ways], phase, level, ahead)
                echo = self._echo if level else self._first
                away = self._away(level, here)
                expected = [reflected(each, away) for each in answers]
                if level == 0:  # the force depends on what is near this end
                    forces = self._ends.force(-answers)
                    measured = [reflected(-force / u, away) for force in forces]
                else:
                    measured = [reflected(T / u, away)] * len(ways)
                left = _loudness(np.array(measured) - np.array(expected), echo)
                best = int(np.argmin(left))
                apart = _loudness(np.array(expected) - expected[best], echo)
                others = [
                    one for one, way in zip(apart, decided, strict=True) if way != decided[best]
                ]
                share = float(left[best] / min(others))
                if not share <= LEFT_OVER:
                    return Told(walls, level, shares)
                way = ways[best]
                if level == 0:
                    T = -forces[best]
            else:
                share, way = 0.0, [each for each in way if each > level]
            shares.append(share)
            if level in way:
                walls.append(level)
                here = 1 - here
            beyond = [each for each in way if each > level]
            M = self.matrix(walls + beyond, phase, level, level + 1)
            u, T = M[:, 0, 0] * u + M[:, 0, 1] * T, M[:, 1, 0] * u + M[:, 1, 1] * T
        return Told(walls, upto, shares)

    def _ways(self, level: int, walls: Sequence[int]) -> Iterator[list[int]]:
        """Yield all ways to fill the next levels."""
        end = min(level + AHEAD, self._code.levels)

        def filled(at: int, last: int | None) -> Iterator[list[int]]:
            yield []
            for next_one in range(at, end):
                if last is None or last in self._code.below(next_one):
                    for more in filled(next_one + 1, next_one):
                        yield [next_one, *more]

        yield from filled(level, walls[-1] if walls else None)

    def _answers(
        self, words: Sequence[Sequence[int]], phase: int, level: int, ahead: int
    ) -> Complex:
        """Return the tension over the displacement where a level begins, shape (m, F), if the
        element ends behind those ahead, or goes on there without walls.
        """
        stiffness = self._stiffness(words, phase, level, ahead)
        lower = np.zeros((len(words), 2, len(self._ends.tones.omega)), dtype=np.complex128)
        lower[:, 1] = 1.0
        if ahead < self._code.levels:
            for row, walls in zip(lower, words, strict=True):
                row[0] = -self._away(ahead, (phase + len(walls)) % 2)[0]
        found = carried(lower, stiffness, *self._others(level, ahead))
        return np.asarray(-found[:, 0] / found[:, 1])

    def _waves(self, level: int, phase: int) -> tuple[Complex, Complex]:
        """Return the tension over the displacement of waves that go on, and of those that come
        back, in cells of a phase where a level begins.
        """
        at = self._edges[level]
        site = self._design.N - 1 - at if self.end is End.RIGHT else at
        tones = self._ends.tones
        return passing(self._inside.flat[phase, site] + tones.square + tones.loss)

    def forecasts(self, words: Sequence[Sequence[int]], phase: int) -> Array:
        """Return the forecasts for words of which all are like the first but for some levels.

        Args:
            words: Levels of all walls, from this end on.
            phase: Phase of this end.
        """
        levels, first = self._code.levels, words[0]
        each = [self.matrix(first, phase, level, level + 1) for level in range(levels)]
        before = [np.broadcast_to(np.eye(2, dtype=np.complex128), each[0].shape)]
        after = [each[-1][:, 1]]
        for M in each:
            before.append(M @ before[-1])
        for M in reversed(each[:-1]):
            after.append((after[-1][:, None] @ M)[:, 0])
        after = [row.T for row in reversed(after)]  # the lower row of the product from a level on
        beyond = np.zeros_like(after[0])
        beyond[1] = 1.0
        after.append(beyond)
        rows = [after[0]]
        for walls in words[1:]:
            changed = set(walls) ^ set(first)
            low, high = max(0, min(changed) - AROUND), min(levels, max(changed) + AROUND + 1)
            stiffness = self._stiffness([walls], phase, low, high)
            row = carried(after[high][None], stiffness, *self._others(low, high))[0]
            rows.append(np.einsum('if,fij->jf', row, before[low]))
        return self._ends.parts(np.array(rows))


def _loudness(reflected: Complex, echo: Complex) -> Array:
    """Return how loud echoes are, shape (m,)."""
    return np.asarray(np.linalg.norm(reflected @ echo, axis=1))


class Peeled:
    """Reads a register that is too long for a forecast of every word.

    Attributes:
        code: The words.
        listener: Makes parts of what both ends do.
        quiet: Noise (`Listener.noise`) up to which every level is told.
    """

    ends = (End.LEFT, End.RIGHT)

    def __init__(self, made: Specimen, settings: Settings) -> None:
        """Prepare for an element; raises `SettingsError` as `code_of`."""
        code = code_of(made.design, settings)
        if code is None or not code.odd:
            raise SettingsError('only a register that is shifted is read from both ends inward')
        self.code, self.listener = code, Listener(settings)
        ends, inside = Ends(made, settings, self.listener), Cells(made)
        self._design = made.design
        self.sides = {end: Side(end, inside, code, ends, settings) for end in End}
        dense = self._dense()
        parts = self._parts([dense, *self._neighbours(dense, few=True)])
        least = float(np.linalg.norm(parts[1:] - parts[0], axis=1).min())
        self.quiet = LEFT_OVER * LEFT_OVER * least * least / NOISE

    def _dense(self) -> tuple[int, ...]:
        """Return the levels of a word with as many walls as there may be."""
        return tuple(range(self.code.levels - 1, -1, -self.code.spacing))[::-1]

    def _parts(self, words: Sequence[Sequence[int]]) -> Array:
        """Return the forecasts for words of as many walls, odd or even, from both ends."""
        left = self.sides[End.LEFT].forecasts(words, len(words[0]) % 2)
        right = self.sides[End.RIGHT]
        mirrored = [[right.own(level) for level in reversed(walls)] for walls in words]
        return np.concatenate((left, right.forecasts(mirrored, 0)), axis=1)

    def _neighbours(self, walls: Sequence[int], few: bool = False) -> list[list[int]]:
        """Return words that differ in one place: a wall elsewhere, two elsewhere, two none."""
        found = []
        middle = len(walls) // 2
        for n in range(middle - 1, middle + 1) if few else range(len(walls)):
            for many in (1, 2):
                here = list(walls[n : n + many])
                for by in (-4, -2, 2, 4):
                    found.append([*walls[:n], *(each + by for each in here), *walls[n + many :]])
            found.append([*walls[:n], *walls[n + 2 :]] if n + 2 <= len(walls) else list(walls))
        allowed = set(range(self.code.levels)).issuperset if few else self.code.allows
        walls = list(walls)
        return [each for each in found if each != walls and allowed(each)]

    def decode(
        self, shots: Sequence[Shot], noise: float, phases: Sequence[int | None], least: float
    ) -> Reading:
        """Return the word of what the ends did after a pulse of each; see `Forecasts.decode`."""
        nothing = Reading(UNDECODABLE, '', End.LEFT.value, None, 0.0, 0.0, math.inf)
        if reason := unheard(shots, noise > self.quiet, phases):
            return replace(nothing, reason=reason)
        motions = {shot.end: (shot.samples - shot.rest[:, None]) for shot in shots}
        upto, dt = min(self.code.levels, self.code.levels // 2 + BOTH), shots[0].dt
        told = {
            end: side.told(motions[end][end.row], dt, phases[end.row] or 0, upto)
            for end, side in self.sides.items()
        }
        low, high = told[End.LEFT].known, self.code.levels - told[End.RIGHT].known
        first = told[End.LEFT].walls
        last = [self.code.levels - 1 - each for each in reversed(told[End.RIGHT].walls)]
        if high > low:
            return replace(nothing, reason=self._beyond(low, first, high, last))
        middle = self._seam(told, low, high)
        walls = [each for each in first if each < middle]
        walls += [each for each in last if each >= middle]
        agree = [each for each in first if each >= high] == [each for each in last if each < low]
        if not (agree and self.code.allows(walls) and len(walls) % 2 == phases[End.LEFT.row]):
            return replace(
                nothing,
                reason=f'the ends do not agree about the levels {high} to {low - 1}: something '
                'else answers, or there is noise',
            )
        parts = self._parts([walls, *self._likely(walls)])
        part = np.concatenate([self.listener.part(motions[end], dt) for end in End])
        part = self._in_order(part)
        off = part - parts[0]
        ways = parts[1:] - parts[0]
        square = np.square(ways).sum(axis=1)
        allowed = LEFT_OVER * math.sqrt(float(square.min(initial=math.inf)))
        remains = float(np.linalg.norm(off))
        if remains > allowed:
            return replace(
                nothing,
                reason=f'the forecast for the walls that are heard leaves {remains / allowed:.3g} '
                'times what it may: something else answers, or there is noise',
            )
        shares = told[End.LEFT].left[:middle]
        shares += told[End.RIGHT].left[: self.code.levels - middle]
        along = max(float((ways @ off / square).max()), *shares)
        margin = round(1.0 - 2.0 * along, 6)
        if margin < least:
            return replace(nothing, reason=f'what is heard lies between words ({margin:.2f})')
        word = self.code.word(walls)
        return replace(
            nothing, level=word, code=self.code.binary(word), level_margin=margin,
            threshold_margin=round(allowed / max(remains, 1e-3 * allowed), 6), walls=len(walls),
        )  # fmt: skip

    def _seam(self, told: Mapping[End, Told], low: int, high: int) -> int:
        """Return from which level on the right end says best what is there, of those both tell."""
        left, right = told[End.LEFT].left, told[End.RIGHT].left[::-1]
        worst = [
            max([0.0, *left[:level], *right[level - high :]]) for level in range(high, low + 1)
        ]
        return high + worst.index(min(worst))

    def _likely(self, walls: Sequence[int]) -> list[list[int]]:
        """Return the neighbours of a word whose ends have the same phases."""
        some = self._neighbours(walls) or [[0, 3]]
        return [each for each in some if len(each) % 2 == len(walls) % 2]

    def _in_order(self, part: Array) -> Array:
        """Return the parts of the left and the right end's pulse as forecast: that of the right
        one begins with the right end.
        """
        quarter = len(part) // 4
        left, far, near = part[: 2 * quarter], part[2 * quarter : 3 * quarter], part[3 * quarter :]
        return np.concatenate((left, near, far))

    def _beyond(self, low: int, first: list[int], high: int, last: list[int]) -> str:
        """Return what is known, and where nothing is."""
        design = self._design
        told = [f'{len(first)} walls from the {End.LEFT}', f'{len(last)} from the {End.RIGHT}']
        a, b = (design.defect(level) - design.J // 2 for level in (low, high))
        return (
            f'{" and ".join(told)} are known, but nothing is from cell {a} to {b}: something else '
            'answers, or there is noise'
        )


def reader_of(made: Specimen, settings: Settings) -> Register | Peeled:
    """Return what reads an element with many walls; raises as `forecasts_of` and `Peeled`."""
    return Peeled(made, settings) if settings.register.shifted else forecasts_of(made, settings)


@lru_cache(maxsize=8)
def reader(design: Design, settings: Settings) -> Register | Peeled:
    """Return what reads an ideal element; raises as `reader_of`."""
    return reader_of(Specimen(design), settings)
