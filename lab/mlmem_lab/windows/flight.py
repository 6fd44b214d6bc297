# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where a kick leaves the wall, on a bare chain as the device steps it; and how far each of its
quantities may be off.

`search_kicks` finds kicks for a new design, or for one element.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from mlmem.instrument.drivers import Simulation
from mlmem.instrument.end import BoundaryMotion, Kick
from mlmem.move_settings import KickSettings
from mlmem.physics import (
    Chain,
    Design,
    HeldCell,
    Scatter,
    Specimen,
    StateError,
    find_level,
    scattered,
    substep_times,
)
from mlmem.physics.energy import energy
from mlmem.physics.equilibrium import find_pinned_wall, make_blank
from mlmem.physics.potential import Array
from mlmem.physics.wall import arrival_tolerance
from mlmem.readers.reading import BLANK, UNDECODABLE
from mlmem.settings import Settings

KICK_SPEEDS = np.geomspace(0.002, 1.2, 321)
"""Mean speeds of kicks: 2 % apart."""

DAMPING_TIMES = 10.0
"""Of rest after a motion."""

KICK_QUANTITIES = ('speed', 'gain', 'hold', 'late')
"""What of a kick may be off: `gain` makes all its displacements greater, as a transducer that is
calibrated wrong; `late` is off by that itself, the others by that share of themselves."""

STEP, FARTHEST = 0.02, 0.3
"""Changes of a quantity that are tried, until the first at which the move fails."""


def build_chain(made: Specimen, settings: Settings, finer: int = 1) -> Chain:
    """Return the chain of an element as the device steps it, or with `finer` times the steps."""
    return Simulation.of(made, settings.time, finer).chain


def drive_end(
    chain: Chain,
    site: int,
    motion: BoundaryMotion,
    rest: float,
) -> int:
    """Drive an end of an unstrained chain, let it rest, and return the level where the wall is:
    `BLANK` for none, `UNDECODABLE` for a wall elsewhere, or several.
    """
    steps = math.ceil((motion.duration + rest) / chain.dt)
    times = substep_times(steps, chain.dt, chain.integrator)
    held = HeldCell(site, motion.at(times[times <= motion.duration]))
    try:
        chain.advance(np.zeros(len(times)), held)
    except StateError:  # driven so hard that the chain diverges
        return UNDECODABLE
    return find_level(chain.design, chain.configuration, arrival_tolerance(chain.design))


def rest_time(chain: Chain) -> float:
    """Return the time after which nothing moves any more."""
    return DAMPING_TIMES / chain.design.eta


def build_kick(
    chain: Chain, speed: float, shape: KickSettings, quantity: str = '', off: float = 0.0
) -> Kick:
    """Return a kick from where the left end is to its other phase, with one quantity off."""
    start, design = chain.end(1), chain.design
    other = design.D_s2 if start < design.D_barrier else design.D_s1
    gain = 1.0 + off if quantity == 'gain' else 1.0
    if quantity == 'speed':
        speed *= 1.0 + off
    elif quantity == 'hold':
        shape = replace(shape, hold=shape.hold * (1.0 + off))
    elif quantity == 'late':
        shape = replace(shape, late=min(1.0, max(0.0, shape.late + off)))
    target = start + gain * (other - start)
    return Kick(start, target, gain * speed, shape)


def after_kick(
    chain: Chain, speed: float, shape: KickSettings, quantity: str = '', off: float = 0.0
) -> int:
    """Return where a kick from rest leaves the wall, as `drive_end`."""
    chain.place(make_blank(chain.specimen))
    return drive_end(chain, 1, build_kick(chain, speed, shape, quantity, off), rest_time(chain))


def after_erase(
    chain: Chain, level: int, shape: KickSettings, quantity: str = '', off: float = 0.0
) -> int:
    """Return where the kick that erases leaves the wall of a level, as `drive_end`."""
    chain.place(find_pinned_wall(chain.specimen, level))
    kick = build_kick(chain, shape.erase_speed, shape, quantity, off)
    return drive_end(chain, 1, kick, rest_time(chain))


def find_scattered_ends(
    design: Design,
    settings: Settings,
    scatter: float,
    speeds: Mapping[int, Sequence[float]],
    rest: float,
) -> list[list[int]]:
    """Return where kicks from blank leave the wall of elements whose parts scatter, as
    `drive_end`, a row for each element.

    Args:
        design: The design.
        settings: Its settings, which shape the kicks.
        scatter: Relative standard deviation of on-site stiffness, springs and masses.
        speeds: Mean speeds by the seed of the element.
        rest: Time after a kick in which the wall comes to rest.
    """
    chain, deviations = (
        build_chain(Specimen(design), settings),
        Scatter(alpha=scatter, k_r=scatter, mass=scatter),
    )
    found = []
    for seed, own in speeds.items():
        chain.set_specimen(scattered(design, deviations, seed))
        ends = []
        for speed in own:
            chain.place(make_blank(chain.specimen))
            kick = build_kick(chain, float(speed), settings.kick)
            ends.append(drive_end(chain, 1, kick, rest))
        found.append(ends)
    return found


def measure_kick_energy(design: Design, settings: Settings, speed: float) -> float:
    """Return the energy that a kick gives a blank element, in k_r a^2: kinetic and potential."""
    chain = build_chain(Specimen(design), settings)
    chain.place(make_blank(chain.specimen))
    before = energy(chain).total
    drive_end(chain, 1, build_kick(chain, speed, settings.kick), 0.0)
    return energy(chain).total - before


def margin_to_failure(fails: Callable[[float], bool], farthest: float = FARTHEST) -> float:
    """Return how far a quantity may be off to either side: the nearest change at which a move
    fails, to 0.005; `farthest` if none was seen.
    """
    for off in np.arange(STEP, farthest + 0.5 * STEP, STEP):
        if bad := [side for side in (off, -off) if fails(side)]:
            low, high = off - STEP, off
            while high - low > 0.005:
                middle = 0.5 * (low + high)
                if any(fails(math.copysign(middle, side)) for side in bad):
                    high = middle
                else:
                    low = middle
            return round(float(high), 3)
    return farthest


def kick_margins(chain: Chain, level: int, shape: KickSettings) -> dict[str, float]:
    """Return how far each quantity of the kick to a level may be off."""
    speed = shape.wall_speeds[level]

    def kick_fails(quantity: str, off: float) -> bool:
        return after_kick(chain, speed, shape, quantity, off) != level

    return {each: margin_to_failure(partial(kick_fails, each)) for each in KICK_QUANTITIES}


def erase_margins(
    chain: Chain, level: int, shape: KickSettings, farthest: float = FARTHEST
) -> dict[str, float]:
    """Return how far each quantity of the kick that erases a level may be off."""

    def erase_fails(quantity: str, off: float) -> bool:
        return after_erase(chain, level, shape, quantity, off) != BLANK

    return {
        each: margin_to_failure(partial(erase_fails, each), farthest) for each in KICK_QUANTITIES
    }


@dataclass(frozen=True)
class Found:
    """The kick to a level that was found.

    Attributes:
        speed: Its mean speed; 0 if no kick leads there.
        room: Least relative change of the speed that leads elsewhere.
    """

    speed: float = 0.0
    room: float = 0.0


def search_kicks(chain: Chain, shape: KickSettings, fastest: float = math.inf) -> list[Found]:
    """Return the kick to every level of an element: the middle of its slowest range of speeds that
    is wide enough, or else of the widest, none of which needs more than the `fastest` speed of the
    end. A fast wall that was turned back comes to a level, too, but then faster is not farther.
    """
    speeds = KICK_SPEEDS[::2][KICK_SPEEDS[::2] * shape.peak_speed_ratio <= fastest]
    ends = np.array([after_kick(chain, float(u), shape) for u in speeds])
    return [
        middle_speed(
            np.flatnonzero(ends == level), partial(speed_edge, chain, shape, level, speeds, ends)
        )
        for level in range(chain.design.levels)
    ]


def middle_speed(there: np.ndarray, edge_at: Callable[[int, int], float]) -> Found:
    """Return the middle of the slowest range of speeds that is wide enough, or else of the widest.

    Args:
        there: Numbers of the speeds that were tried and lead there, in order.
        edge_at: Returns the edge of a range: from the number of its last speed to a side, -1 or 1.
    """
    best = Found()
    for run in np.split(there, np.flatnonzero(np.diff(there) > 1) + 1) if there.size else ():
        low, high = edge_at(int(run[0]), -1), edge_at(int(run[-1]), 1)
        found = Found(float(f'{math.sqrt(low * high):.4g}'), round(math.sqrt(high / low) - 1.0, 3))
        if found.room >= ENOUGH_SPEED_MARGIN:
            return found
        best = max(found, best, key=lambda each: each.room)
    return best


EDGE_TOLERANCE = 5e-4
"""Relative error of the edge of a range of speeds."""


def speed_edge(
    chain: Chain,
    shape: KickSettings,
    level: int,
    speeds: Array,
    ends: np.ndarray,
    inside: int,
    way: int,
) -> float:
    """Return how far the speed of a level may change to one side, by bisection from a speed that
    leads there and is the last that was tried on that side, or has others beyond.
    """
    while 0 <= inside + way < len(speeds) and ends[inside + way] == level:
        inside += way
    good = float(speeds[inside])
    if not 0 <= inside + way < len(speeds):
        return good
    bad = float(speeds[inside + way])
    while abs(bad / good - 1.0) > EDGE_TOLERANCE:
        middle = math.sqrt(good * bad)
        if after_kick(chain, middle, shape) == level:
            good = middle
        else:
            bad = middle
    return good


def least_erase_margin(chain: Chain, shape: KickSettings) -> float:
    """Return how far the speed of the kick that erases may be off at the worst level."""

    def erase_fails(level: int, off: float) -> bool:
        return after_erase(chain, level, shape, 'speed', off) != BLANK

    levels = range(chain.design.levels)
    if any(erase_fails(level, 0.0) for level in levels):
        return 0.0
    return min(margin_to_failure(partial(erase_fails, level)) for level in levels)


ENOUGH_SPEED_MARGIN = 0.1
"""A kick is wide enough if its speed may be off by so much."""
