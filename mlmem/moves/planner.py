# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The moves of the wall between levels, their durations, and the fastest path.

Levels and the blank element are nodes of a graph; moves are its edges: a launch, a step up and an
erase by strain; a kick to a level and a kick that erases without strain (docs/strainless.md). A
write takes the shortest path.
"""

from __future__ import annotations

import heapq
import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import Enum

from ..errors import ProcedureFailed
from ..instrument.motion import Cycle
from ..move_settings import select_peak
from ..physics import Design, wall_energy
from ..readers.reading import BLANK, describe_level
from ..settings import Settings

STRAIN_PENALTY = 1e9
"""Time that a strained move seems to take where strain is avoided."""

RINGING_DAMPING_TIMES = 12.0
"""Damping times until an element that was strained fast is quiet enough to be read."""


MIN_MOVE_MARGIN = 0.1
"""A move is not used that fails where something of it is less off than this, relative."""


class How(Enum):
    """Ways to move a wall."""

    LAUNCH = 'launch'
    STEP = 'step up'
    ERASE = 'erase'
    KICK = 'kick'
    KICK_OUT = 'kick out'

    @property
    def strains(self) -> bool:
        """Whether it needs the actuator."""
        return self not in (How.KICK, How.KICK_OUT)


@dataclass(frozen=True)
class Move:
    """One move.

    Attributes:
        how: The way.
        start: Level at which it begins, or `BLANK`.
        target: Level at which it ends, or `BLANK`.
        time: Duration in time units; approximate for an erase, which listens in between.
        room: Relative change that its quantities bear: the speed of a kick (its stroke bears less,
            docs/strainless.md); peak and times of what strains bear `MIN_MOVE_MARGIN` at least.
        energy: What the end puts in, in k_r cells^2, in closed form; NaN where there is none
            (docs/energy.md).
    """

    how: How
    start: int
    target: int
    time: float
    room: float = MIN_MOVE_MARGIN
    energy: float = math.nan


def step_cycle(design: Design, settings: Settings, start: int, force: float = 1.0) -> Cycle:
    """Return the strain of a step up from a level.

    `force` is a factor on its peak, within the actuator's limit.
    """
    limit = settings.actuator.max_strain
    wanted = force * select_peak(settings.write, design.is_freed_by_compression(start))
    return Cycle.plan_cycle(
        settings.write, max(-limit, min(wanted, limit)), settings.actuator.max_rate
    )


def soften_release(settings: Settings) -> Settings:
    """Return settings whose steps up end as gently as the last one of a write."""
    write = settings.write
    release = max(write.release, write.last_release)
    return replace(settings, write=replace(write, release=release))


def disable_kicks(settings: Settings) -> Settings:
    """Return settings without kicks, if there is an actuator."""
    if not settings.actuator.present:
        return settings
    return replace(settings, write=replace(settings.write, method='strain'))


def kick_speed(design: Design, settings: Settings, level: int) -> float:
    """Return the mean speed of the kick from blank to a level; 0 if there is none."""
    speeds, limits = settings.kick.wall_speeds, settings.transducer
    speed = speeds[level] if level < len(speeds) else 0.0
    able = abs(design.D_s2 - design.D_s1) <= limits.max_stroke
    return speed if able and settings.kick.peak_speed_ratio * speed <= limits.max_speed else 0.0


def kick_energy(design: Design, level: int) -> float:
    """Return the energy of the wall that a kick sends to a level.

    It is a particle of rest energy and mass E in a medium where waves run at speed 1, and damping
    takes its momentum on the way to X: E sqrt(1 + (eta X)^2).
    """
    return wall_energy(design) * math.hypot(1.0, design.eta * design.defect_site(level))


def erase_speed(design: Design, settings: Settings) -> float:
    """Return the mean speed of the kick that erases one wall; 0 if kicks do not erase."""
    kick, limits = settings.kick, settings.transducer
    able = settings.write.method != 'strain' and any(kick.wall_speeds)
    able &= abs(design.D_s2 - design.D_s1) <= limits.max_stroke
    able &= kick.peak_speed_ratio * kick.erase_speed <= limits.max_speed
    return kick.erase_speed if able else 0.0


def find_moves(design: Design, settings: Settings, start: int) -> Iterator[Move]:
    """Yield the moves that begin at a level, or at the blank element, are wide enough and cross no
    stuck cell.
    """
    for move in _find_all_moves(design, settings, start):
        blocked = move.target >= 0 and settings.element.explain_blocked(
            design.defect_site(move.target)
        )
        if move.room >= MIN_MOVE_MARGIN and not blocked:
            yield move


def _find_all_moves(design: Design, settings: Settings, start: int) -> Iterator[Move]:
    if settings.write.method != 'strain':
        yield from _find_kicks(design, settings, start)
    if settings.actuator.present:
        yield from _find_strained_moves(design, settings, start)


def _find_kicks(design: Design, settings: Settings, start: int) -> Iterator[Move]:
    kick, stroke = settings.kick, abs(design.D_s2 - design.D_s1)
    if start != BLANK:
        if speed := erase_speed(design, settings):
            yield Move(How.KICK_OUT, start, BLANK, stroke / speed + kick.hold + kick.erase_settle)
        return
    for level in range(design.levels):
        if speed := kick_speed(design, settings, level):
            time, energy = stroke / speed + kick.hold + kick.settle, kick_energy(design, level)
            yield Move(How.KICK, BLANK, level, time, kick.room(level), energy)


def _find_strained_moves(design: Design, settings: Settings, start: int) -> Iterator[Move]:
    rate = settings.actuator.max_rate
    if start == BLANK:
        write = settings.write
        moving = abs(design.D_s2 - design.D_s1) / write.launch_speed
        cycle = Cycle.plan_cycle(write, write.start_strain, rate)
        yield Move(How.LAUNCH, BLANK, 0, cycle.duration + moving)
        return
    if start < design.levels - 1:
        cycle = Cycle.plan_cycle(settings.write, settings.write.tension, rate)
        yield Move(How.STEP, start, start + 1, cycle.duration)
    if erase_speed(design, settings):
        return  # it leaves less behind that brakes a kick
    kink = Cycle.plan_cycle(settings.erase, settings.erase.compression, rate)
    yield Move(How.ERASE, start, BLANK, (start + 2) * kink.duration + ringing_time(design))


def half_period(design: Design) -> float:
    """Return half a period of the inactive cells swinging in phase, as after a ramp.

    At that band edge waves do not propagate; they ring at the right end until damped.
    """
    return math.pi / math.sqrt(design.k_s1)


def ringing_time(design: Design) -> float:
    """Return how long an element rings after a fast strain; 0 if it never stops."""
    return RINGING_DAMPING_TIMES / design.eta if design.eta > 0.0 else 0.0


def find_reachable_levels(design: Design, settings: Settings) -> set[int]:
    """Return the levels, and `BLANK`, to which moves lead from a blank element."""
    found, ways = {BLANK}, [BLANK]
    while ways:
        targets = {move.target for move in find_moves(design, settings, ways.pop())} - found
        found |= targets
        ways += targets
    return found


def find_route(design: Design, settings: Settings, start: int, target: int) -> list[Move]:
    """Return the fastest moves from one level, or `BLANK`, to another (Dijkstra); with
    `write.method` kick, those with the least strain.

    Raises:
        ProcedureFailed: There is no way: without an actuator, or past a stuck cell.
    """
    order = itertools.count()
    ways: list[tuple[float, int, int, list[Move]]] = [(0.0, next(order), start, [])]
    seen = set()
    aside = STRAIN_PENALTY if settings.write.method == 'kick' else 0.0
    while ways:
        time, _, place, way = heapq.heappop(ways)
        if place == target:
            return way
        if place in seen:
            continue
        seen.add(place)
        for move in find_moves(design, settings, place):
            if move.how is How.ERASE and place != start:
                continue  # an erase is that fast only if the wall was read
            cost = time + move.time + aside * move.how.strains
            heapq.heappush(ways, (cost, next(order), move.target, [*way, move]))
    if target >= 0 and (why := settings.element.explain_blocked(design.defect_site(target))):
        raise ProcedureFailed(f'level {target} cannot be reached: {why}')
    raise ProcedureFailed(
        f'{describe_level(target)} is reached only by strain: it needs an actuator, or, with '
        'write.method kick or auto, kicks within the limits of the transducers'
    )
