# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Maps of kicks, and how many end elsewhere on an element that is not as designed, that
rings or that is shaken.

In a map a row is a text with a character for every point: the digit of the level (36 to a digit),
`-` for blank and `.` for anything else.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mlmem import Preset, preset
from mlmem.instrument.end import Kick
from mlmem.move_settings import KickSettings
from mlmem.physics import Chain, Scatter, Specimen, StateError, find_walls, scattered
from mlmem.physics.energy import energy
from mlmem.physics.equilibrium import blank, resting_wall
from mlmem.physics.potential import Array
from mlmem.readers.reading import BLANK, UNDECODABLE

from .flight import Course, after_erase, bare, drive, kick_of, rest_of

SPEEDS = np.geomspace(0.002, 1.2, 65)

DIGITS = '0123456789abcdefghijklmnopqrstuvwxyz'


def digit(level: int) -> str:
    """Return the character of a level, of `BLANK`, or of `UNDECODABLE`."""
    return {BLANK: '-', UNDECODABLE: '.'}.get(level) or DIGITS[level]


def levels_of(rows: Sequence[str]) -> Array:
    """Return the levels of a map, shape (rows, columns)."""
    known = {each: level for level, each in enumerate(DIGITS)} | {'-': BLANK, '.': UNDECODABLE}
    return np.array([[known[each] for each in row] for row in rows])


@dataclass(frozen=True)
class Map:
    """Where a motion ends, over two of its quantities.

    Attributes:
        across, up: Names of the quantities.
        xs, ys: Their values.
        at: From both to the level.
    """

    across: str
    up: str
    xs: Sequence[float] | Array
    ys: Sequence[float] | Array
    at: Callable[[float, float], int]

    def as_dict(self) -> dict[str, Any]:
        """Return it for a result file."""
        rows = [''.join(digit(self.at(float(x), float(y))) for x in self.xs) for y in self.ys]
        xs, ys = ((np.round(each, 5) + 0.0).tolist() for each in (self.xs, self.ys))
        return {'across': self.across, 'up': self.up, 'xs': xs, 'ys': ys, 'rows': rows}


def maps(name: str) -> dict[str, Any]:
    """Return the maps of a preset, from rest and as designed, by name."""
    element = preset(name)
    chain = bare(Specimen(element.design), element.settings)
    return {each: one.as_dict() for each, one in _maps(chain, element).items()}


def _maps(chain: Chain, element: Preset) -> dict[str, Map]:
    shape = element.settings.kick

    def kicked(course: Callable[[float, float], Kick | Course]) -> Callable[[float, float], int]:
        def at(speed: float, other: float) -> int:
            chain.place(blank(chain.specimen))
            return drive(chain, 1, course(speed, other), rest_of(chain))

        return at

    def plain(speed: float, **shaped: Any) -> Kick:
        return kick_of(chain, speed, replace(shape, **shaped))

    def beyond(speed: float, overshoot: float) -> Course:
        """To `overshoot` cells beyond the ground state, and back to it."""
        first = plain(speed, hold=0.0)
        if not overshoot:
            return Course((plain(speed),))
        far = replace(first, target=first.target + overshoot)
        return Course((far, Kick(far.target, first.target, speed, shape)))

    def halved(speed: float, pause: float) -> Course:
        """In two halves with a pause between them."""
        whole = plain(speed)
        middle = 0.5 * (whole.start + whole.target)
        first = replace(whole, target=middle, shape=replace(shape, hold=pause))
        return Course((first, replace(whole, start=middle)))

    def erased(speed: float, level: float) -> int:
        return after_erase(chain, int(level), replace(shape, erase_speed=speed))

    return {
        'ramp': Map('speed', 'late', SPEEDS, np.arange(0.0, 1.01, 0.1),
                    kicked(lambda u, late: plain(u, late=late))),
        'hold': Map('speed', 'hold', SPEEDS, (0, 1, 2, 5, 10, 15, 20, 30, 50, 100),
                    kicked(lambda u, hold: plain(u, hold=hold))),
        'overshoot': Map('speed', 'overshoot', SPEEDS, np.arange(-0.2, 0.41, 0.05),
                         kicked(beyond)),
        'two parts': Map('speed', 'pause', SPEEDS, (0, 1, 2, 3, 5, 7, 10, 15, 20),
                         kicked(halved)),
        'erase': Map('speed', 'level', SPEEDS, range(element.design.levels), erased),
    }  # fmt: skip


# --- elements that are not as designed ---------------------------------------------------------

SCATTERED = (3e-4, 1e-3, 3e-3, 1e-2)
"""Standard deviations of alpha, springs and masses from cell to cell, relative."""

DAMPED = (0.03, 0.1, 0.2)
"""Relative changes of the damping of all cells, to either side."""

LEFT_OVER = (0.75, 0.5, 0.25, 0.0)
"""Shares of `kick.erase_settle` after which the kick follows one that erases."""

SHAKES = (1e-4, 3e-4, 1e-3, 3e-3)
"""Amplitudes of a base that swings, in cells per time unit squared."""

BEATS = (0.02, 0.0789, 0.3, 0.47)
"""Its frequencies, at random phases: slow, near that of a pinned wall, and the lower band edge."""


def astray(name: str, elements: int, seed: int) -> dict[str, list[dict[str, Any]]]:
    """Return how many kicks to every level end elsewhere, and how many that erase leave the wall
    there, by what is not as designed and how much.
    """
    element, random = preset(name), np.random.default_rng(seed)
    design, settings = element
    found: dict[str, list[dict[str, Any]]] = {}

    def count(what: str, amount: float, chains: Iterator[Chain], shaken: bool = False) -> None:
        row = {'amount': amount, 'kicks': 0, 'astray': 0, 'erases': 0, 'stayed': 0}
        for chain in chains:
            for level, speed in enumerate(settings.kick.by_level):
                shake = _swing(random, amount) if shaken else None
                if speed:
                    chain.place(blank(chain.specimen))
                    kick = kick_of(chain, speed, settings.kick)
                    row['kicks'] += 1
                    row['astray'] += drive(chain, 1, kick, rest_of(chain), shake) != level
                row['erases'] += 1
                row['stayed'] += _erased(chain, level, settings.kick, shake) != BLANK
        found.setdefault(what, []).append(row)

    for what in ('alpha', 'k_r', 'mass'):
        for amount in SCATTERED:
            made = (
                scattered(design, Scatter(**{what: amount}), seed + k) for k in range(elements)
            )
            count(what, amount, (bare(each, settings) for each in made))
    for amount in DAMPED:
        both = (Specimen(design, eta_factor=1.0 + side * amount) for side in (1, -1))
        count('damping', amount, (bare(each, settings) for each in both))
    count('half steps', 2.0, iter([bare(Specimen(design), settings, 2)]))
    for amount in SHAKES:
        count('shaking', amount, iter([bare(Specimen(design), settings)] * 2), shaken=True)
    return found | {'ringing': [_ringing(element, share) for share in LEFT_OVER]}


def _swing(random: np.random.Generator, amplitude: float) -> Callable[[Array], Array]:
    omega, phase = random.choice(BEATS), random.uniform(0.0, 2.0 * math.pi)
    return lambda t: amplitude * np.sin(omega * t + phase)


def _erased(
    chain: Chain, level: int, shape: KickSettings, shake: Callable[[Array], Array] | None
) -> int:
    try:
        chain.place(resting_wall(chain.specimen, level))
    except StateError:  # scattered so much that no wall rests there
        return BLANK
    return drive(chain, 1, kick_of(chain, shape.erase_speed, shape), rest_of(chain), shake)


def _ringing(element: Preset, share: float) -> dict[str, Any]:
    """Return how many kicks end elsewhere that begin when a share of `kick.erase_settle` has
    passed after one that erases.
    """
    design, settings = element
    chain, shape = bare(Specimen(design), settings), settings.kick
    row = {'amount': share, 'kicks': 0, 'astray': 0}
    for start in (0, design.levels - 1):
        chain.place(resting_wall(chain.specimen, start))
        rest = share * shape.erase_settle
        drive(chain, 1, kick_of(chain, shape.erase_speed, shape), rest)
        state = chain.state()
        for level, speed in enumerate(shape.by_level):
            if speed:
                chain.restore(state, V_N=0.0, steps_done=0)
                row['kicks'] += 1
                kick = kick_of(chain, speed, shape)
                row['astray'] += drive(chain, 1, kick, rest_of(chain)) != level
    return row


def stored(chain: Chain, speed: float, shape: KickSettings) -> tuple[float, float]:
    """Return the energy that a kick leaves in the chain when the end is released, and where the
    wall is then; 0 if there is none.
    """
    chain.place(blank(chain.specimen))
    before = energy(chain).total
    drive(chain, 1, kick_of(chain, speed, shape), 0.0)
    found = find_walls(chain.design, chain.configuration)
    return energy(chain).total - before, found[0].position if len(found) == 1 else 0.0
