# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The moves of the wall between levels, their durations, and the fastest path.

Levels and the blank element are nodes of a graph; moves are its edges: a launch, a step up, a
stroke up or down, a throw, an erase. A write takes the shortest path (docs/going_back.md).
"""

from __future__ import annotations

import heapq
import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import Enum

from ..physics import Design
from .motion import Cycle
from .reading import BLANK
from .settings import CycleSettings, Settings, StrokeSettings, peak

RINGING = 12.0
"""Damping times until an element that was strained fast is quiet enough to be read."""


class How(Enum):
    """Ways to move a wall."""

    LAUNCH = 'launch'
    STEP = 'step up'
    STROKE = 'stroke'
    THROW = 'throw'
    ERASE = 'erase'


@dataclass(frozen=True)
class Move:
    """One move.

    Attributes:
        how: The way.
        start: Level at which it begins, or `BLANK`.
        target: Level at which it ends, or `BLANK`.
        time: Duration in time units; approximate for an erase, which listens in between.
    """

    how: How
    start: int
    target: int
    time: float


def cycle_of(design: Design, settings: Settings, move: Move, force: float = 1.0) -> Cycle:
    """Return the strain of a step up, a stroke or a throw.

    `force` is a factor on the peak of a step up, within the actuator's limit.
    """
    if move.how is How.THROW:
        pulses = 1 + move.start // settings.throw.levels
        return sum((throw_cycle(settings, pulse) for pulse in range(pulses)), Cycle(()))
    if move.how is How.STROKE:
        stroke = stroke_of(settings, move.start, upward=move.target > move.start)
        times: CycleSettings = stroke
        wanted = stroke_peak(design, stroke, move.start)
    else:
        times = settings.write
        wanted = force * peak(settings.write, design.freed_by_compression(move.start))
    limit = settings.actuator.max_strain
    return Cycle.planned(times, max(-limit, min(wanted, limit)), settings.actuator.max_rate)


def stroke_of(settings: Settings, start: int, *, upward: bool) -> StrokeSettings:
    """Return the stroke that may begin at a level."""
    if upward:
        return settings.up_odd if start % 2 else settings.up_even
    return settings.down_odd if start % 2 else settings.down_even


def stroke_peak(design: Design, stroke: StrokeSettings, start: int) -> float:
    """Return the peak of a stroke from a level.

    The farther the site, the farther a stroke moves the wall, because the substrate moves by the
    strain times the site. The factor (X_last / X) ** growth compensates.
    """
    farther = design.defect(design.levels - 1) / design.defect(start)
    return float(stroke.peak * farther**stroke.growth)


def gentle(settings: Settings) -> Settings:
    """Return settings whose steps up end as gently as the last one of a write."""
    write = settings.write
    release = max(write.release, write.last_release)
    return replace(settings, write=replace(write, release=release))


def paper_way(settings: Settings) -> Settings:
    """Return settings without strokes and throws."""
    none = StrokeSettings()
    erase = replace(settings.erase, method='kink')
    return replace(settings, erase=erase, down_even=none, down_odd=none, up_even=none, up_odd=none)


def throw_cycle(settings: Settings, pulse: int) -> Cycle:
    """Return the pulse with this number, from 0, of a throw; every second one is mirrored."""
    throw = settings.throw
    share = throw.mirrored if pulse % 2 else 1.0
    return Cycle.planned(throw, share * throw.peak, settings.actuator.max_rate)


def throws(settings: Settings) -> bool:
    """Return whether an erase begins with a throw."""
    return settings.erase.method == 'pulse' and settings.throw.peak != 0.0


def moves_from(design: Design, settings: Settings, start: int) -> Iterator[Move]:
    """Yield the moves that begin at a level, or at the blank element."""
    rate = settings.actuator.max_rate
    if start == BLANK:
        write = settings.write
        moving = abs(design.D_s2 - design.D_s1) / write.launch_speed
        cycle = Cycle.planned(write, write.start_strain, rate)
        yield Move(How.LAUNCH, BLANK, 0, cycle.duration + moving)
        return
    if start < design.levels - 1:
        cycle = Cycle.planned(settings.write, settings.write.tension, rate)
        yield Move(How.STEP, start, start + 1, cycle.duration)
    for upward in (True, False):
        stroke = stroke_of(settings, start, upward=upward)
        target = start + stroke.levels * (1 if upward else -1)
        begins = start >= stroke.lowest and start not in stroke.barred
        if stroke.peak and begins and 0 <= target < design.levels:
            cycle = Cycle.planned(stroke, stroke_peak(design, stroke, start), rate)
            yield Move(How.STROKE, start, target, cycle.duration)
    if throws(settings) and start not in settings.throw.barred:
        out = Move(How.THROW, start, BLANK, 0.0)
        yield replace(out, time=cycle_of(design, settings, out).duration)
    else:
        kink = Cycle.planned(settings.erase, settings.erase.compression, rate)
        pulse = throw_cycle(settings, 0)
        moving = pulse.duration if throws(settings) else (start + 2) * kink.duration
        yield Move(How.ERASE, start, BLANK, moving + ringing(design))


def half_period(design: Design) -> float:
    """Return half a period of the inactive cells swinging in phase, as after a ramp.

    At that band edge waves do not propagate; they ring at the right end until damped.
    """
    return math.pi / math.sqrt(design.k_s1)


def ringing(design: Design) -> float:
    """Return how long an element rings after a fast strain; 0 if it never stops."""
    return RINGING / design.eta if design.eta > 0.0 else 0.0


def route(design: Design, settings: Settings, start: int, target: int) -> list[Move]:
    """Return the fastest moves from one level, or `BLANK`, to another (Dijkstra)."""
    order = itertools.count()
    ways: list[tuple[float, int, int, list[Move]]] = [(0.0, next(order), start, [])]
    seen = set()
    while True:  # every place is reachable by an erase, a launch and steps
        time, _, place, way = heapq.heappop(ways)
        if place == target:
            return way
        if place in seen:
            continue
        seen.add(place)
        for move in moves_from(design, settings, place):
            if move.how in (How.ERASE, How.THROW) and place != start:
                continue  # an erase is that fast only if the wall was read, a throw sure from rest
            heapq.heappush(ways, (time + move.time, next(order), move.target, [*way, move]))
