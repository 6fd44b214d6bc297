# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Bad cells that are known: what the element answers with them, and which levels are left.

A stuck cell lets no wall pass, and no pulse: of the two ends one detects the wall, and no delay of
that end alone proves a level. So an element with known bad cells is read as registers are: by one
pulse inside both pass bands, whose waveform at both ends is compared with the forecast for every
level. The pulse passes the wall and comes back from the cell, too, which confirms both. Behind a
stuck cell a pulse of the right end must detect no wall.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from ..errors import ErrorCode, SettingsError
from ..instrument.echo import pulse_duration
from ..instrument.end import End, Shot
from ..physics import Design, Specimen
from ..physics.waves import group_velocity, pass_band
from ..settings import Settings
from .decoding import make_undecodable
from .reading import BLANK, UNDECODABLE, Reading
from .register import Content, Forecasts, pin_contents, pin_walls
from .waveforms import Ends, Listener

MAX_FORECAST_DISTANCE = 0.5
"""Most that this distance counts: with few levels forecasts are far apart."""


class BadCells(Forecasts):
    """What both ends do by level with known bad cells.

    Attributes:
        usable: The levels that can be used.
    """

    def __post_init__(self) -> None:
        super().__post_init__()
        contents, parts, lost = self.contents, self.parts, self.lost
        from_blank = np.linalg.norm(parts - parts[0], axis=1)
        from_blank[0] = from_blank[1:].min(initial=np.inf)
        pulse = self.pulse_size
        self.nearest_distances = np.minimum(
            self.nearest_distances, np.minimum(from_blank, MAX_FORECAST_DISTANCE * pulse)
        )
        alike = {
            each.number: 'cannot be told: it sounds like another level'
            for each, near in zip(contents, self.nearest_distances, strict=True)
            if near < 0.02 * pulse  # a forecast must differ by 2 % of the pulse from any other
        }
        alike.pop(UNDECODABLE, None)
        self.lost = dict(sorted({**alike, **lost}.items()))
        self.limits = '; '.join(_describe_lost(self.lost)) or 'every level can be used'
        for row, each in enumerate(contents):
            if each.number in self.lost:  # what is like it is refused anyway
                self.nearest_distances[row] = MAX_FORECAST_DISTANCE * pulse
        levels = {each.number for each in contents if len(each.walls) == 1}
        self.usable = tuple(sorted(levels - set(self.lost)))
        if BLANK in self.lost or not self.usable:
            why = f'the element is lost with them: {self.limits}'
            raise SettingsError(ErrorCode.UNSUPPORTED, 'element.bad_cells', reason=why)

    @property
    def least_distance(self) -> float:
        """The least distance between a level that is used, or blank, and any other."""
        used = [each.number in (BLANK, *self.usable) for each in self.contents]
        return float(self.nearest_distances[used].min())

    def decode(
        self, shot: Shot, noise: float, phases: Sequence[int | None], least: float
    ) -> Reading:
        """Return the level, as `Forecasts.decode`; one that cannot be used is undecodable."""
        reading = super().decode(shot, noise, phases, least)
        if reading.level == UNDECODABLE and reading.walls:
            return make_undecodable(reading, f'there are {reading.walls} walls', reading.walls)
        if why := self.lost.get(reading.level):
            reason = f'it sounds like level {reading.level}, which {why}'
            return make_undecodable(reading, reason, reading.walls)
        return reading


def _describe_lost(lost: Mapping[int, str]) -> Iterator[str]:
    for level, why in lost.items():
        if lost.get(level - 1) == why:
            continue
        last = next(n for n in itertools.count(level) if lost.get(n + 1) != why)
        yield f'level{f" {level}" if last == level else f"s {level} to {last}"} {why}'


def add_bad_cells(design: Design, settings: Settings) -> Specimen:
    """Return the element of a design with the known bad cells.

    Raises:
        SettingsError: The design has no such cell.
    """
    alpha, given = np.ones(design.N), settings.element
    most = design.N - 1 if given.stuck_sites else design.N
    if (last := max((*given.stuck_sites, *given.weak_factors), default=0)) > most:
        expected = f'from 2 to {most} in a design of {design.N} cells'
        raise SettingsError(ErrorCode.CONFLICT, 'bad_cells', last, expected)
    for site, factor in given.weak_factors.items():
        alpha[site - 1] = factor
    return Specimen(design, alpha_factor=alpha, stuck=given.stuck_sites)


def list_wall_sets(levels: int, reached: int) -> Iterator[tuple[int, ...]]:
    """Yield one wall at every level; then, up to those that are reached, what must not be taken
    for it: two walls near each other, or a wall with two behind it.
    """
    yield from ((level,) for level in range(levels))
    for first, apart in itertools.product(range(reached), (1, 2)):
        if first + apart < reached:
            yield first, first + apart
        # beyond eight levels, the echo of a second wall is too faint to matter
        for n in range(first + 1, min(first + 8, reached - apart)):
            yield first, n, n + apart


@lru_cache(maxsize=8)
def forecast_bad_cells(design: Design, settings: Settings) -> BadCells:
    """Return the forecasts with the known bad cells, in the phase of a blank element. Which levels
    a write reaches, `factory.rehearse_levels` tells.

    Raises:
        SettingsError: The design has no such cell, its substrate is elastic, it is too long, the
            pulse is not inside both pass bands, or no level is left.
    """
    made, settings = add_bad_cells(design, settings), _extend_listening(design, settings)
    levels, lost = range(design.levels), dict[int, str]()
    for level in levels:
        if why := settings.element.explain_blocked(design.defect_site(level)):
            lost[level] = f'cannot be reached: {why}'
    contents, at = pin_contents(made, list_wall_sets(design.levels, design.levels - len(lost)))
    for level in sorted(set(levels) - {each.number for each in contents}):
        lost.setdefault(level, 'cannot be held: no wall rests there beside a bad cell')
    listener = Listener(settings)
    ends = Ends(made, settings, listener)
    hidden_part = _forecast_hidden_part(made, settings, ends, listener)
    answers = ends.compute_answers(made, at)
    return BadCells(contents, answers, listener, lost=lost, hidden_part=hidden_part)


def _forecast_hidden_part(
    made: Specimen, settings: Settings, ends: Ends, listener: Listener
) -> Forecasts | None:
    """Return what both ends do after a pulse of the right end if stuck cells hide a part from the
    left one: no wall is behind the last of them, or two are near each other.
    """
    if not settings.element.stuck_sites:
        return None
    design, cell = made.design, max(settings.element.stuck_sites)
    first = next((n for n in range(design.levels) if design.defect_site(n) > cell), design.levels)
    pairs = itertools.product(range(first, design.levels), (1, 2))
    contents, at = pin_contents(
        made, [(low, low + apart) for low, apart in pairs if low + apart < design.levels]
    )
    found = Forecasts(contents, ends.compute_answers(made, at, End.RIGHT), listener, End.RIGHT)
    farthest = MAX_FORECAST_DISTANCE * found.pulse_size
    found.nearest_distances = np.minimum(found.nearest_distances, farthest)
    return found


def forecast_stuck_cells(design: Design, settings: Settings, sites: Iterable[int]) -> Forecasts:
    """Return what both ends of a blank element do with a stuck cell, by its site; 0 if none is.

    Raises:
        SettingsError: Such an element is not read; see `forecast_bad_cells`.
    """
    settings = _extend_listening(design, settings)
    listener, rest = Listener(settings), [pin_walls(Specimen(design), ())]
    made = [Specimen(design), *(Specimen(design, stuck=(site,)) for site in sites)]
    ends = Ends(made[0], settings, listener)
    parts = np.concatenate([ends.compute_answers(each, rest) for each in made])
    return Forecasts([Content(sum(each.stuck), (), '') for each in made], parts, listener)


def _extend_listening(design: Design, settings: Settings) -> Settings:
    """Return settings whose read listens until the pulse comes back from the farthest cell."""
    probe = settings.register.probe
    if design.substrate == 'elastic' or design.N > 1000:
        found = design.N, design.substrate
        expected = 'among at most 1000 cells, over a rigid substrate'
        raise SettingsError(ErrorCode.UNSUPPORTED, 'bad_cells', found, expected)
    one, other = (pass_band(k_s) for k_s in (design.k_s1, design.k_s2))
    low, high = max(one[0], other[0]), min(one[1], other[1])
    if not low < probe.omega_c < high:
        raise SettingsError(
            ErrorCode.CONFLICT, 'register.omega_c', probe.omega_c,
            f'inside both pass bands, {low:.4g} to {high:.4g}, to read an element with bad cells',
        )  # fmt: skip
    slowest = min(float(group_velocity(probe.omega_c, k_s)) for k_s in (design.k_s1, design.k_s2))
    listen = max(settings.register.listen, 2.0 * design.N / slowest + pulse_duration(probe))
    return replace(settings, register=replace(settings.register, listen=math.ceil(listen)))
