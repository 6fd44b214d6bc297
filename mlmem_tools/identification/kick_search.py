# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where a kick leaves the wall, on a bare chain as the device steps it; and how far its speed may
be off.

`search_kicks` finds kicks for a new design, or for one element.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from mlmem.instrument.drivers import Simulation
from mlmem.instrument.end import BoundaryMotion
from mlmem.moves.kick import KickMotion, KickSettings
from mlmem.physics import Chain, HeldCell, Specimen, StateError, find_level, substep_times
from mlmem.physics.equilibrium import find_pinned_wall, make_blank
from mlmem.physics.wall import arrival_tolerance
from mlmem.readers.reading import BLANK, UNDECODABLE
from mlmem.settings import Settings

KICK_SPEEDS = np.geomspace(0.002, 1.2, 321)
"""Mean speeds of kicks: 2 % apart."""


def build_chain(made: Specimen, settings: Settings) -> Chain:
    """Return the chain of an element as the device steps it."""
    return Simulation.build_blank(made, settings.time).chain


def drive_end(
    chain: Chain,
    motion: BoundaryMotion,
    rest_time: float | None = None,
    site: int = 1,
    tolerance: float | None = None,
) -> int:
    """Drive an end of an unstrained chain, by default the left one, and let it come to rest in so
    much time, by default ten damping times. A wall is at a level if it is near enough, by default
    `arrival_tolerance`.

    Returns:
        The level where the wall is: `BLANK` for none, `UNDECODABLE` for a wall at no level, or
        several.
    """
    if rest_time is None:
        rest_time = 10.0 / chain.design.eta
    steps = math.ceil((motion.duration + rest_time) / chain.dt)
    times = substep_times(steps, chain.dt)
    held = HeldCell(site, motion.evaluate_motion(times[times <= motion.duration]))
    try:
        chain.advance(np.zeros(len(times)), held)
    except StateError:  # driven so hard that the chain diverges
        return UNDECODABLE
    near = arrival_tolerance(chain.design) if tolerance is None else tolerance
    return find_level(chain.design, chain.configuration, near)


def build_kick(chain: Chain, speed: float, shape: KickSettings) -> KickMotion:
    """Return a kick from where the left end is to its other phase."""
    start, design = chain.end(1), chain.design
    return KickMotion(
        start, design.D_s2 if start < design.D_barrier else design.D_s1, speed, shape
    )


def after_kick(chain: Chain, speed: float, shape: KickSettings) -> int:
    """Return where a kick of a blank element leaves the wall, as `drive_end`."""
    chain.place(make_blank(chain.specimen))
    return drive_end(chain, build_kick(chain, speed, shape))


def after_erase(chain: Chain, level: int, speed: float, shape: KickSettings) -> int:
    """Return where a kick that erases leaves the wall of a level, as `drive_end`."""
    chain.place(find_pinned_wall(chain.specimen, level))
    return drive_end(chain, build_kick(chain, speed, shape))


def find_speed_edge(
    is_good: Callable[[float], bool], speed: float, step: float, farthest: float = 2.0
) -> float:
    """Return how far a good speed may change to one side.

    Args:
        step: Ratio of the speeds that are tried until one is not good; then they are bisected.
        farthest: Ratio at which no farther one is tried.
    """
    inside = speed
    while is_good(outside := inside * step):
        inside = outside
        if max(inside / speed, speed / inside) > farthest:
            return inside
    while abs(outside / inside - 1.0) > 5e-4:
        middle = math.sqrt(inside * outside)
        inside, outside = (middle, outside) if is_good(middle) else (inside, middle)
    return inside


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

    def leads_to(level: int, speed: float) -> bool:
        allowed = speed * shape.peak_speed_ratio <= fastest
        return allowed and after_kick(chain, speed, shape) == level

    def find_edge(level: int, inside: int, way: int) -> float:
        return find_speed_edge(partial(leads_to, level), float(speeds[inside]), 1.04**way)

    return [
        middle_speed(np.flatnonzero(ends == level), partial(find_edge, level))
        for level in range(chain.design.levels)
    ]


def middle_speed(there: np.ndarray, edge_at: Callable[[int, int], float]) -> Found:
    """Return the middle of the slowest range of speeds that is a tenth wide, or of the widest.

    Args:
        there: Numbers of the speeds that were tried and lead there, in order.
        edge_at: Returns the edge of a range: from the number of its last speed to a side, -1 or 1.
    """
    best = Found()
    for run in np.split(there, np.flatnonzero(np.diff(there) > 1) + 1) if there.size else ():
        low, high = edge_at(int(run[0]), -1), edge_at(int(run[-1]), 1)
        found = Found(float(f'{math.sqrt(low * high):.4g}'), round(math.sqrt(high / low) - 1.0, 3))
        if found.room >= 0.1:
            return found
        best = max(found, best, key=lambda each: each.room)
    return best


def least_erase_margin(chain: Chain, shape: KickSettings) -> float:
    """Return how far the speed of the kick that erases may be off at the worst level, up to 0.3;
    0 if it leaves a wall.
    """

    def is_erased(level: int, speed: float) -> bool:
        return after_erase(chain, level, speed, shape) == BLANK

    speed, margins = shape.erase_speed, []
    for level in range(chain.design.levels):
        if not is_erased(level, speed):
            return 0.0
        low, high = (
            find_speed_edge(partial(is_erased, level), speed, step, farthest=1.3)
            for step in (1.0 / 1.04, 1.04)
        )
        margins.append(min(speed / low, high / speed) - 1.0)
    return min(0.3, *margins)
