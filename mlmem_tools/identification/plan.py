# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pulses for one element: what takes its wall from level to level, and how far from failure."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from mlmem.element_file import Element
from mlmem.instrument.blocks import run
from mlmem.instrument.drivers import Simulation
from mlmem.memory import Memory
from mlmem.physics import Chain, DesignError, Specimen, StateError, default_step, find_walls
from mlmem.physics.equilibrium import find_pinned_wall, make_blank, relax_to_equilibrium
from mlmem.physics.values import Array
from mlmem.procedures.writing import go_to_level
from mlmem.readers.calibration import (
    Calibration,
    DelayTable,
    PulseCorrection,
    PulseCorrections,
    hash_schedule,
)
from mlmem.readers.reading import BLANK
from mlmem.readers.register import find_wall_levels, pin_walls
from mlmem.settings import Settings

from .kick_search import (
    KICK_SPEEDS,
    Found,
    build_chain,
    build_kick,
    drive_end,
    least_erase_margin,
    middle_speed,
    search_kicks,
)

Report = Callable[[str, float], object]
"""Is told what is being planned, and the fraction done."""


@dataclass(frozen=True)
class Step:
    """A pulse of a plan.

    Attributes:
        level: Level to which it takes the wall, from the one below; 0: a launch.
        correction: Factors on the pulse in the settings.
        margin: Relative distance of the peak, or of the speed of a kick, from failure, as far as
            it was tried; negative if no pulse was found.
    """

    level: int
    correction: PulseCorrection
    margin: float


@dataclass(frozen=True)
class Plan:
    """Pulses to every level.

    Attributes:
        corrections: The same for a calibration.
        erase: What the speed of the kick that erases bears; 0 if it leaves a wall at some level,
            NaN for an element that is written by strain.
        kinks: Kicks of kinks to the levels behind which a wall may rest; empty for one wall.
    """

    steps: tuple[Step, ...]
    corrections: PulseCorrections
    erase: float = math.nan
    kinks: tuple[Step, ...] = ()

    @property
    def complete(self) -> bool:
        """Whether there is a pulse to every level."""
        return all(step.margin >= 0.0 for step in (*self.steps, *self.kinks))


def plan_pulses(specimen: Specimen, intended: Element, report: Report | None = None) -> Plan:
    """Return the pulses for an element.

    Each is simulated on the element, also with a peak that is a little off, and starts where the
    one before left the wall. Where the settings write by kicks, it is the middle of the widest
    range of speeds that leads to the level.

    The intended element has the design and the settings of its instrument.
    """
    report, settings = report or (lambda what, share: None), intended.settings
    chain, levels = build_chain(specimen, settings), intended.design.levels
    if settings.holds_words:
        return _plan_register(chain, settings, report)
    tried = _Trial(specimen, intended)
    state, steps, erase = tried.place_wall(BLANK), [], math.nan
    by_kicks = [Found()] * levels
    if settings.is_kicked(0):
        by_kicks = search_kicks(chain, settings.kick, settings.transducer.max_speed)
        erase = least_erase_margin(chain, settings.kick)
    for level in range(levels):
        report(f'level {level}', level / levels)
        if settings.is_kicked(level):
            speed = settings.kick.wall_speeds[level]
            step, state = _correct_kick(level, speed, by_kicks[level]), tried.place_wall(level)
        else:
            step, state = _choose_best(tried, state, level)
        steps.append(step)
    corrections = PulseCorrections(
        tuple(step.correction for step in steps), hash_schedule(settings)
    )
    return Plan(tuple(steps), corrections, erase)


def _plan_register(chain: Chain, settings: Settings, report: Report) -> Plan:
    """Return the kicks of walls and kinks for an element that holds many.

    Each is the middle of the slowest range of speeds that is wide enough, or else of the widest,
    whatever rests ahead: see `_list_cases_ahead`. Kinks come to no level behind which no wall may
    rest.
    """
    design, kick = chain.design, settings.kick
    levels = design.levels

    @cache
    def kick_behind(walls: tuple[int, ...], speed: float) -> tuple[int, ...] | None:
        """Return the levels of all walls after a kick behind some at rest; None if a wall is at
        none, or these do not rest.
        """
        try:
            chain.place(pin_walls(chain.specimen, walls))
        except StateError:
            return None
        drive_end(chain, build_kick(chain, speed, kick))
        return find_wall_levels(design, chain.configuration)

    speeds = KICK_SPEEDS[kick.peak_speed_ratio * KICK_SPEEDS <= settings.transducer.max_speed]
    max_speed_factor = 2.5  # most by which a speed may differ from that in the settings
    found: tuple[list[Step], list[Step]] = [], []
    for kind, shipped in enumerate((kick.wall_speeds, kick.kink_speeds)):
        for level in range(levels):
            report(f'{("wall", "kink")[kind]} to level {level}', (kind + level / levels) / 2.0)
            cases = _list_cases_ahead(levels, settings.register.spacing, level, kind)
            if not cases:
                break
            cases.sort(key=lambda each: (len(each), *(-wall for wall in each)))  # common ones
            good = [
                abs(math.log(speed / shipped[level])) <= math.log(max_speed_factor)
                and all(kick_behind(each, speed) == (level, *each) for each in cases)
                for speed in map(float, speeds)
            ]
            best = middle_speed(np.flatnonzero(good), lambda at, _: float(speeds[at]))
            found[kind].append(_correct_kick(level, shipped[level], best))
    walls, kinks = map(tuple, found)
    unused = (1.0,) * (len(walls) - len(kinks))
    corrections = PulseCorrections(
        tuple(step.correction for step in walls), hash_schedule(settings),
        kinks=(*(step.correction.speed for step in kinks), *unused),
    )  # fmt: skip
    return Plan(walls, corrections, kinks=kinks)


def _list_cases_ahead(levels: int, spacing: int, level: int, kind: int) -> list[tuple[int, ...]]:
    """Return what may rest to the right of a wall (kind 0) or kink (1) at a level."""
    near = [tuple(range(level + spacing, levels, spacing)[:count]) for count in range(4)]
    far = [(levels - 1,)] if level + spacing < levels else []
    return sorted({each for each in (*near, *far) if len(each) % 2 == kind})


def _correct_kick(level: int, speed: float, found: Found) -> Step:
    """Return a kick as a factor on the speed in the settings."""
    if not found.speed:
        return Step(level, PulseCorrection(), -1.0)
    factor = found.speed / speed
    return Step(level, PulseCorrection(speed=min(max(factor, 0.1), 10.0)), found.room)


def _choose_best(tried: _Trial, state: Array, level: int) -> tuple[Step, Array]:
    """Return the pulse to a level that is farthest from failure, and the state after it."""
    best, after = Step(level, PulseCorrection(), -1.0), tried.place_wall(level)
    launch_speeds = (1.0, 2.0)  # factors that are tried, nearest to the settings first
    speeds = (1.0,) if level else launch_speeds
    # relative changes at which a pulse is tried, too; the distance to failure follows
    trial_radii = (0.05, 0.1, 0.15)
    enough_margin = 0.15  # distance to failure at which no better pulse is sought
    peak_factors = (1.0, 0.9, 1.15, 0.8, 1.3, 1.5, 0.7, 1.8, 2.2)
    time_factors = (1.0, 0.42, 0.5, 1.3, 0.3, 0.36, 0.7, 1.6, 0.2, 2.2)
    for speed, times, peak in itertools.product(speeds, time_factors, peak_factors):
        correction = PulseCorrection(peak, times, speed)
        reached = tried.try_pulse(state, level, correction)
        if reached is None:
            continue
        margin = 0.0
        for radius in trial_radii:
            around = (
                replace(correction, peak=correction.peak * (1.0 + by)) for by in (-radius, radius)
            )
            if any(tried.try_pulse(state, level, each) is None for each in around):
                break
            margin = radius
        if margin > best.margin:
            best, after = Step(level, correction, margin), reached
        if margin >= enough_margin:
            break
    return best, after


class _Trial:
    """Pulses on a simulated copy of the element."""

    def __init__(self, specimen: Specimen, intended: Element) -> None:
        self.intended, self._specimen = intended, specimen
        design, time = intended.design, intended.settings.time
        dt = time.tick / np.ceil(time.tick / default_step(specimen))
        self._chain = Chain(specimen, float(dt))
        delays = DelayTable(tuple(float(level) for level in range(design.levels)))
        self._memory = Memory(
            design, intended.settings, Calibration(delays, delays), Simulation(self._chain)
        )

    def place_wall(self, level: int) -> Array:
        """Return the element with its wall at a level, at rest, if that holds it, else blank."""
        try:
            v = find_pinned_wall(self._specimen, level)
        except StateError:
            v = make_blank(self._specimen)
        self._chain.place(v)
        return self._chain.state()

    def try_pulse(self, state: Array, level: int, correction: PulseCorrection) -> Array | None:
        """Return the state after a pulse if it takes the wall to a level, at rest."""
        memory, chain, design = self._memory, self._chain, self.intended.design
        chain.restore(state, V_N=0.0, steps_done=chain.steps_done)
        memory.transducer.assume_equilibrium()
        corrections = [correction] * design.levels
        try:
            start = level - 1 if level else BLANK
            run(memory, go_to_level(memory, start, level, plainly=True, corrections=corrections))
        except (StateError, DesignError):
            memory.stop_after_failure('')
            return None
        try:
            rest = relax_to_equilibrium(self._specimen, chain.v, np.zeros(design.N))
        except StateError:
            return None
        found = find_walls(self._specimen.design, rest)
        # a wall has arrived within a cell of its defect
        if len(found) != 1 or abs(found[0].position - design.defect_site(level)) > 1.0:
            return None
        chain.place(rest)
        return chain.state()
