# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Many walls in one element: which words it holds, and what it answers to a pulse in each.

Walls and kinks alternate, from the right end on, and rest at levels that are at least
`register.spacing` apart. A pulse whose carrier lies inside both pass bands passes every wall and
brings an echo of each. What both ends do after it is forecast for every word; the nearest forecast
names the word, if what is left is no more than noise.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ..clipped import clipped
from ..physics import Design, Specimen, StateError, walls
from ..physics.equilibrium import relax, wall_profile
from ..physics.potential import Array
from .driver import Simulation
from .echo import pulse_duration
from .end import End, Shot
from .errors import SettingsError
from .instrument import LONGEST_RUN, Instrument
from .reading import UNDECODABLE, Reading
from .settings import Settings

MOST_WORDS = 4096
"""Words up to which all forecasts are made: each takes some milliseconds and 16 kB."""

NEAR = 2.0
"""Distance in cells up to which a wall rests at the defect of its level."""

LEFT_OVER = 0.3
"""What may be left of a waveform when its forecast is taken off, relative to the distance of that
forecast from any other: what explains half of the distance could be another word."""

NOISE = 2.0
"""Ratio up to which the noise during a read may exceed that before it."""

BAND = 4.0
"""Half of the band that is compared, over 1 / sigma of the pulse: all of its spectrum. Slow waves
that are left of a kick lie outside."""

EDGE = 4.0
"""Length over which the recording is faded in and out, over sigma."""


class Code(NamedTuple):
    """Numbers as sets of levels at least `spacing` apart (Cover 1973, IEEE Trans. Inf. Theory 19).

    With a spacing of 1 the levels are the bits of the number. Otherwise words are numbered in the
    order of their highest levels, as binary numbers are.
    """

    levels: int
    spacing: int

    @property
    def words(self) -> int:
        """Number of words; the first, 0, is that of the blank element."""
        return self._below(self.levels)

    def _below(self, level: int) -> int:
        """Return how many words use only levels below one."""
        counts = [1] * self.spacing  # of -spacing + 1 ... 0 levels
        for _ in range(level):
            counts.append(counts[-1] + counts[-self.spacing])
        return counts[-1]

    def walls(self, word: int) -> tuple[int, ...]:
        """Return the levels of a word, the lowest first."""
        found = []
        for level in reversed(range(self.levels)):
            if word >= (below := self._below(level)):
                word -= below
                found.append(level)
        return tuple(reversed(found))

    def word(self, walls: Sequence[int]) -> int:
        """Return the word of levels."""
        return sum(self._below(level) for level in walls)

    @property
    def each(self) -> list[int]:
        """The words of one wall, at every level."""
        return [self.word([level]) for level in range(self.levels)]

    def binary(self, word: int) -> str:
        """Return a word in binary digits."""
        return f'{word:0{(self.words - 1).bit_length()}b}'


def code_of(design: Design, settings: Settings) -> Code | None:
    """Return the code of an element with many walls, or None for one wall.

    Raises:
        SettingsError: The schedule has not one speed for each level, or there are too many words.
    """
    if not (spacing := settings.register.spacing):
        return None
    code = Code(design.levels, spacing)
    for name, speeds in (('speeds', settings.kick.by_level), ('kinks', settings.kick.of_kinks)):
        if len(speeds) < design.levels or not all(speeds[: design.levels]):
            raise SettingsError(
                f'a register needs a kick to each of its {design.levels} levels, of walls and of '
                f'kinks; got kick.{name} {clipped(getattr(settings.kick, name))}'
            )
    if code.words > MOST_WORDS:
        raise SettingsError(
            f'a register may have {MOST_WORDS} words at most, all of which are forecast; this one '
            f'has {code.words}: increase register.spacing'
        )
    return code


def words_of(design: Design, settings: Settings) -> int:
    """Return how many contents an element tells apart; raises as `code_of`."""
    code = code_of(design, settings)
    return design.levels if code is None else code.words


def resting(made: Specimen, levels: Sequence[int]) -> Array:
    """Return the displacements of an unstrained element with walls and kinks at some levels.

    Raises:
        StateError: They do not rest there.
    """
    design = made.design
    share = np.zeros(design.N)  # of the active phase
    step = design.D_s2 - design.D_s1
    for number, level in enumerate(sorted(levels, reverse=True)):
        left = (wall_profile(design, design.defect(level) + 0.3) - design.D_s1) / step
        share = share * (1.0 - left) + (1.0 - number % 2) * left
    stuck = np.array(made.stuck, dtype=np.int64) - 1
    share[stuck] = np.round(share[stuck])  # in the phase of its place
    v = relax(made, design.D_s1 + step * share + made.offsets, np.zeros(design.N))
    found = sorted(wall.position for wall in walls(design, v))
    wanted = [design.defect(level) for level in sorted(levels)]
    if len(found) != len(wanted) or any(
        abs(one - other) > NEAR for one, other in zip(found, wanted, strict=True)
    ):
        raise StateError(
            f'walls at the levels {list(levels)} do not rest there; they are at {found}'
        )
    return v


class Listener:
    """What is heard after the pulse of a read: the part of both ends' motion in its band.

    Attributes:
        ticks: Ticks for which both ends are recorded.
    """

    def __init__(self, settings: Settings) -> None:
        """Prepare for the pulse of the settings."""
        self._probe = settings.register.probe
        time = pulse_duration(self._probe) + settings.register.listen
        self._tick = settings.time.tick
        self.ticks = math.ceil(time / self._tick)
        self._bases: dict[tuple[int, float], Array] = {}

    def _band(self, n: int, dt: float) -> Array:
        """Return the windowed cosines and sines of the band for n samples, shape (n, 2 m)."""
        if (known := self._bases.get((n, dt))) is not None:
            return known
        probe, span = self._probe, n * dt
        low, high = (
            round((probe.omega_c + side * BAND / probe.sigma) * span / (2.0 * math.pi))
            for side in (-1.0, 1.0)
        )
        t = dt * np.arange(1.0, n + 1.0)
        edge = np.minimum(t, span + dt - t) / min(EDGE * probe.sigma, 0.5 * span)
        window = 0.5 * (1.0 - np.cos(math.pi * np.minimum(1.0, edge))) * math.sqrt(2.0 * dt / n)
        phase = 2.0 * math.pi / span * np.outer(t, np.arange(max(1, low), high + 1))
        basis = np.concatenate((np.cos(phase), np.sin(phase)), axis=1) * window[:, None]
        self._bases[n, dt] = basis
        return basis

    def part(self, motion: Array, dt: float) -> Array:
        """Return the part of both ends' motion, shape (2, n), in the band: (4 m,)."""
        return (motion @ self._band(motion.shape[1], dt)).ravel()

    def noise(self, before: Array, dt: float) -> float:
        """Return what noise contributes to the square of `part`, from displacements of both ends
        before the pulse, shape (2, w).
        """
        motion = before - before.mean(axis=1, keepdims=True)
        basis = self._band(before.shape[1], dt)
        lines = round(2.0 * BAND / self._probe.sigma * self.ticks * self._tick / (2.0 * math.pi))
        share: float = (2.0 * lines + 2.0) / basis.shape[1]
        power: float = np.square(motion @ basis).sum()
        return power * share


class Content(NamedTuple):
    """What an element may hold: its number, the levels of its walls, and its code."""

    number: int
    walls: tuple[int, ...]
    code: str


class Forecasts:
    """What both ends do after the pulse of a read, by content.

    Attributes:
        contents: What the element may hold, one a row of `parts`.
        parts: In the band, shape (contents, 2 m); see `Listener`.
        nearest: Distance of every part to the nearest one with the same phase at the left end,
            shape (contents,).
        listener: Makes parts.
    """

    def __init__(self, contents: Sequence[Content], parts: Array, listener: Listener) -> None:
        self.contents, self.parts, self.listener = tuple(contents), parts, listener
        self._odd = np.array([len(each.walls) % 2 for each in contents])
        square = np.square(parts).sum(axis=1)
        apart = square[:, None] + square - 2.0 * parts @ parts.T
        apart[self._odd[:, None] != self._odd] = np.inf
        np.fill_diagonal(apart, np.inf)
        self.nearest = np.sqrt(np.maximum(apart.min(axis=1), 0.0))

    @property
    def least(self) -> float:
        """The least distance between what is told apart."""
        return float(self.nearest.min())

    @property
    def quiet(self) -> float:
        """Noise (`Listener.noise`) up to which every content can be told from all others."""
        return LEFT_OVER * LEFT_OVER * self.least * self.least / NOISE

    def decode(
        self, shot: Shot, noise: float, phases: Sequence[int | None], least: float
    ) -> Reading:
        """Return the content of what both ends did after a pulse, given the noise before and the
        phases of the ends.

        The nearest forecast must leave no more than `LEFT_OVER` of its distance to any other, and
        `least` is the least margin in the direction of any: 1 at the forecast, 0 half-way. So an
        error at one end or at both, of any shape, that is smaller than half the difference of two
        words changes none; a greater one is the difference of two words, or is refused.
        """
        nothing = Reading(UNDECODABLE, '', End.LEFT.value, None, 0.0, 0.0, math.inf)
        if None in phases:
            end = End.LEFT if phases[0] is None else End.RIGHT
            return replace(nothing, reason=f'the {end} end rests in neither phase')
        if phases[1] == 1:
            return replace(nothing, reason='the right end is active: a wall has left the element')
        if not np.isfinite(shot.samples).all():
            return replace(nothing, reason='listening was interrupted')
        part = self.listener.part(shot.samples - shot.rest[:, None], shot.dt)
        same = self._odd == phases[0]
        left = np.where(same, np.square(self.parts - part).sum(axis=1), np.inf)
        row = int(np.argmin(left))
        content = self.contents[row]
        if noise > self.quiet:
            return replace(nothing, reason='the ends move too much to hear every wall')
        allowed = (LEFT_OVER * self.nearest[row]) ** 2
        if left[row] > allowed:
            ratio = math.sqrt(left[row] / allowed)
            return replace(
                nothing,
                reason=f'the nearest forecast, of {content.number}, leaves {ratio:.3g} times what '
                'it may: a wall is between levels, or something else answers, or there is noise',
            )
        ways = np.delete(self.parts[same] - self.parts[row], np.flatnonzero(same) == row, axis=0)
        along = ways @ (part - self.parts[row]) / np.square(ways).sum(axis=1)
        margin = round(1.0 - 2.0 * float(along.max(initial=0.0)), 6)
        if margin < least:
            return replace(nothing, reason=f'what is heard lies between words ({margin:.2f})')
        return replace(
            nothing, level=content.number, code=content.code, level_margin=margin,
            threshold_margin=round(math.sqrt(allowed / max(float(left[row]), 1e-6 * allowed)), 6),
            walls=len(content.walls),
        )  # fmt: skip


class Register(Forecasts):
    """What both ends do by word.

    Attributes:
        code: The words.
    """

    def __init__(self, code: Code, parts: Array, listener: Listener) -> None:
        words = range(code.words)
        contents = [Content(word, code.walls(word), code.binary(word)) for word in words]
        super().__init__(contents, parts, listener)
        self.code = code


@lru_cache(maxsize=8)
def forecasts(design: Design, settings: Settings) -> Register:
    """Return the forecasts of an ideal element; raises as `forecasts_of`."""
    return forecasts_of(Specimen(design), settings)


def forecasts_of(made: Specimen, settings: Settings) -> Register:
    """Return the forecasts of an element in every word.

    Raises:
        SettingsError: The element holds one wall, or walls of a word do not rest at their levels.
    """
    design = made.design
    code = code_of(design, settings)
    if code is None:
        raise SettingsError('an element with one wall is read by its delays')
    listener = Listener(settings)
    resting_at = []
    for word in range(code.words):
        try:
            resting_at.append(resting(made, code.walls(word)))
        except StateError as error:
            raise SettingsError(f'{code.binary(word)} cannot be held: {error}') from error
    return Register(code, heard(made, settings, listener, resting_at), listener)


def heard(
    made: Specimen, settings: Settings, listener: Listener, walls_at: Sequence[Array]
) -> Array:
    """Return the parts of what both ends of an element at rest do after the pulse of a read.

    By the method whose waves do not depend on its step, from the ends' motion at its steps.

    Args:
        made: The element.
        settings: Of its instrument.
        listener: Makes parts.
        walls_at: Displacements, shape (N,) each, in which it rests.

    Returns:
        Shape (number of these, 2 m).
    """
    converged = replace(settings, time=replace(settings.time, integrator='pefrl'))
    twin = Instrument(made.design, converged, Simulation.of(made, converged.time))
    parts = []
    for v in walls_at:
        twin.chain.place(v)
        twin.transducer.assume_rest()
        recorder = twin.transducer.shoot(End.LEFT, settings.register.probe)
        for begin in range(0, listener.ticks, LONGEST_RUN):
            twin.pass_ticks(min(LONGEST_RUN, listener.ticks - begin))
        twin.transducer.release()
        shot = recorder.shot(0.0, 0.0, twin.driver.dt)
        parts.append(listener.part(shot.samples - shot.rest[:, None], shot.dt))
    return np.array(parts)
