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
from mlmem.physics.equilibrium import find_pinned_wall, make_blank
from mlmem.physics.potential import Array
from mlmem.readers.reading import BLANK, UNDECODABLE

from .flight import Course, after_erase, build_chain, build_kick, drive_end, rest_time

KICK_SPEEDS = np.geomspace(0.002, 1.2, 65)

LEVEL_DIGITS = '0123456789abcdefghijklmnopqrstuvwxyz'


def level_digit(level: int) -> str:
    """Return the character of a level, of `BLANK`, or of `UNDECODABLE`."""
    return {BLANK: '-', UNDECODABLE: '.'}.get(level) or LEVEL_DIGITS[level]


def parse_levels(rows: Sequence[str]) -> Array:
    """Return the levels of a map, shape (rows, columns)."""
    known = {each: level for level, each in enumerate(LEVEL_DIGITS)} | {
        '-': BLANK,
        '.': UNDECODABLE,
    }
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
        rows = [
            ''.join(level_digit(self.at(float(x), float(y))) for x in self.xs) for y in self.ys
        ]
        xs, ys = ((np.round(each, 5) + 0.0).tolist() for each in (self.xs, self.ys))
        return {'across': self.across, 'up': self.up, 'xs': xs, 'ys': ys, 'rows': rows}


def compute_maps(name: str) -> dict[str, Any]:
    """Return the maps of a preset, from rest and as designed, by name."""
    element = preset(name)
    chain = build_chain(Specimen(element.design), element.settings)
    return {each: one.as_dict() for each, one in _define_maps(chain, element).items()}


def _define_maps(chain: Chain, element: Preset) -> dict[str, Map]:
    shape = element.settings.kick

    def kicked_level(
        course: Callable[[float, float], Kick | Course],
    ) -> Callable[[float, float], int]:
        def level_at(speed: float, other: float) -> int:
            chain.place(make_blank(chain.specimen))
            return drive_end(chain, 1, course(speed, other), rest_time(chain))

        return level_at

    def plain_kick(speed: float, **shaped: Any) -> Kick:
        return build_kick(chain, speed, replace(shape, **shaped))

    def overshooting_course(speed: float, overshoot: float) -> Course:
        """To `overshoot` cells beyond the ground state, and back to it."""
        first = plain_kick(speed, hold=0.0)
        if not overshoot:
            return Course((plain_kick(speed),))
        far = replace(first, target=first.target + overshoot)
        return Course((far, Kick(far.target, first.target, speed, shape)))

    def halved_course(speed: float, pause: float) -> Course:
        """In two halves with a pause between them."""
        whole = plain_kick(speed)
        middle = 0.5 * (whole.start + whole.target)
        first = replace(whole, target=middle, shape=replace(shape, hold=pause))
        return Course((first, replace(whole, start=middle)))

    def level_after_erase(speed: float, level: float) -> int:
        return after_erase(chain, int(level), replace(shape, erase_speed=speed))

    return {
        'ramp': Map(
            'speed',
            'late',
            KICK_SPEEDS,
            np.arange(0.0, 1.01, 0.1),
            kicked_level(lambda u, late: plain_kick(u, late=late)),
        ),
        'hold': Map(
            'speed',
            'hold',
            KICK_SPEEDS,
            (0, 1, 2, 5, 10, 15, 20, 30, 50, 100),
            kicked_level(lambda u, hold: plain_kick(u, hold=hold)),
        ),
        'overshoot': Map(
            'speed',
            'overshoot',
            KICK_SPEEDS,
            np.arange(-0.2, 0.41, 0.05),
            kicked_level(overshooting_course),
        ),
        'two parts': Map(
            'speed',
            'pause',
            KICK_SPEEDS,
            (0, 1, 2, 3, 5, 7, 10, 15, 20),
            kicked_level(halved_course),
        ),
        'erase': Map(
            'speed', 'level', KICK_SPEEDS, range(element.design.levels), level_after_erase
        ),
    }


# --- elements that are not as designed ---------------------------------------------------------

SCATTER_DEVIATIONS = (3e-4, 1e-3, 3e-3, 1e-2)
"""Standard deviations of alpha, springs and masses from cell to cell, relative."""

DAMPING_CHANGES = (0.03, 0.1, 0.2)
"""Relative changes of the damping of all cells, to either side."""

LEFT_OVER = (0.75, 0.5, 0.25, 0.0)
"""Shares of `kick.erase_settle` after which the kick follows one that erases."""

SHAKE_AMPLITUDES = (1e-4, 3e-4, 1e-3, 3e-3)
"""Amplitudes of a base that swings, in cells per time unit squared."""

SHAKE_FREQUENCIES = (0.02, 0.0789, 0.3, 0.47)
"""Its frequencies, at random phases: slow, near that of a pinned wall, and the lower band edge."""


def count_astray(name: str, elements: int, seed: int) -> dict[str, list[dict[str, Any]]]:
    """Return how many kicks to every level end elsewhere, and how many that erase leave the wall
    there, by what is not as designed and how much.
    """
    element, random = preset(name), np.random.default_rng(seed)
    design, settings = element
    found: dict[str, list[dict[str, Any]]] = {}

    def count(what: str, amount: float, chains: Iterator[Chain], shaken: bool = False) -> None:
        row = {'amount': amount, 'kicks': 0, 'astray': 0, 'erases': 0, 'stayed': 0}
        for chain in chains:
            for level, speed in enumerate(settings.kick.wall_speeds):
                shake = _base_swing(random, amount) if shaken else None
                if speed:
                    chain.place(make_blank(chain.specimen))
                    kick = build_kick(chain, speed, settings.kick)
                    row['kicks'] += 1
                    row['astray'] += drive_end(chain, 1, kick, rest_time(chain), shake) != level
                row['erases'] += 1
                row['stayed'] += _level_after_erase(chain, level, settings.kick, shake) != BLANK
        found.setdefault(what, []).append(row)

    for what in ('alpha', 'k_r', 'mass'):
        for amount in SCATTER_DEVIATIONS:
            made = (
                scattered(design, Scatter(**{what: amount}), seed + k) for k in range(elements)
            )
            count(what, amount, (build_chain(each, settings) for each in made))
    for amount in DAMPING_CHANGES:
        both = (Specimen(design, eta_factor=1.0 + side * amount) for side in (1, -1))
        count('damping', amount, (build_chain(each, settings) for each in both))
    count('half steps', 2.0, iter([build_chain(Specimen(design), settings, 2)]))
    for amount in SHAKE_AMPLITUDES:
        count('shaking', amount, iter([build_chain(Specimen(design), settings)] * 2), shaken=True)
    return found | {'ringing': [_count_ringing(element, share) for share in LEFT_OVER]}


def _base_swing(random: np.random.Generator, amplitude: float) -> Callable[[Array], Array]:
    omega, phase = random.choice(SHAKE_FREQUENCIES), random.uniform(0.0, 2.0 * math.pi)
    return lambda t: amplitude * np.sin(omega * t + phase)


def _level_after_erase(
    chain: Chain, level: int, shape: KickSettings, shake: Callable[[Array], Array] | None
) -> int:
    try:
        chain.place(find_pinned_wall(chain.specimen, level))
    except StateError:  # scattered so much that no wall rests there
        return BLANK
    return drive_end(
        chain, 1, build_kick(chain, shape.erase_speed, shape), rest_time(chain), shake
    )


def _count_ringing(element: Preset, share: float) -> dict[str, Any]:
    """Return how many kicks end elsewhere that begin when a share of `kick.erase_settle` has
    passed after one that erases.
    """
    design, settings = element
    chain, shape = build_chain(Specimen(design), settings), settings.kick
    row = {'amount': share, 'kicks': 0, 'astray': 0}
    for start in (0, design.levels - 1):
        chain.place(find_pinned_wall(chain.specimen, start))
        rest = share * shape.erase_settle
        drive_end(chain, 1, build_kick(chain, shape.erase_speed, shape), rest)
        state = chain.state()
        for level, speed in enumerate(shape.wall_speeds):
            if speed:
                chain.restore(state, V_N=0.0, steps_done=0)
                row['kicks'] += 1
                kick = build_kick(chain, speed, shape)
                row['astray'] += drive_end(chain, 1, kick, rest_time(chain)) != level
    return row


def stored_energy(chain: Chain, speed: float, shape: KickSettings) -> tuple[float, float]:
    """Return the energy that a kick leaves in the chain when the end is released, and where the
    wall is then; 0 if there is none.
    """
    chain.place(make_blank(chain.specimen))
    before = energy(chain).total
    drive_end(chain, 1, build_kick(chain, speed, shape), 0.0)
    found = find_walls(chain.design, chain.configuration)
    return energy(chain).total - before, found[0].position if len(found) == 1 else 0.0
