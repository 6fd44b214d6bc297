# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Strokes and a throw for a design: by closed forms, by a law of the site, or by search over their
times, peaks, and how these fall with the site.

In the closed forms the wall is a particle (see `tolerance.particle`) of mass M. The substrate of
cell j moves by j e, so a strain e that changes its rate pushes a wall at X by -B X e'', with
B = sum of dv_j / dX = D_s2 - D_s1. Pins, gradient and waves are left out, so their proposal
is only a starting point. A map of peaks alone does not show the margins: every trial is judged
with peak and times off in many directions, each in a random element. CMA-ES is the evolution
strategy of Hansen and Ostermeier (2001), by the package cmaes (the extra `search`).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np

from mlmem_ros.device import Settings
from mlmem_ros.device.motion import SMOOTH_PEAK_RATE, Cycle
from mlmem_ros.device.move_settings import StrokeSettings, ThrowSettings
from mlmem_ros.device.moves import stroke_peak
from mlmem_ros.device.strokes import LATE, actuator, by_9, throw
from mlmem_ros.physics import Design, Scatter, Specimen, scattered, walls
from mlmem_ros.physics.potential import Array
from mlmem_tools.checks.bare import COARSE, configuration_after

from ..windows.flight import bare, search_kicks, search_push


def inertia_over_mass(design: Design) -> float:
    """Return B / M of a wall: its throw relative to its position, per unit of strain."""
    D = np.linspace(design.D_s1, design.D_s2, 2001)
    # At rest v'^2 / 2 = psi, so M, the integral of v'^2 over X, is that of sqrt(2 psi) over D.
    return float(1.0 / np.mean(np.sqrt(2.0 * design.potential.energy(D))))


def reach(design: Design, change: float, ease: float) -> float:
    """Return how far a throw carries a wall, relative to its position; from 1 on it leaves.

    Let go by a change of strain, (1 - ease_to) peak, over a time `ease`, the strain falls at
    SMOOTH_PEAK_RATE change / ease at its fastest.
    Until then the well that the strain makes holds the wall. The substrate's deceleration then
    sets the wall moving at B / M X times that rate, and damping ends the flight after 1 / eta.
    """
    rate = SMOOTH_PEAK_RATE * abs(change) / ease
    return inertia_over_mass(design) * rate / design.eta


def shortest_ease(design: Design, change: float) -> float:
    """Return the release time below which all cells of the far end slip to a third state.

    The deceleration of the substrate at cell N pushes that cell by 6 N change / ease^2, with the
    change of strain from the peak, (1 - ease_to) peak, and the slope of the potential below the
    inactive phase holds it.
    """
    below = np.linspace(design.wells[0] - 2.0, design.D_s1, 2001)
    holds = float(design.alpha.min() * np.max(-design.potential.slope(below)))
    return math.sqrt(6.0 * design.N * abs(change) / holds)


Move = TypeVar('Move', bound=StrokeSettings | ThrowSettings)

CLUMSY = 0.5
"""Cost of a throw that leaves the wall at a lower level, relative to one that loses it."""

PRICE = 0.01
"""Cost of every damping time of a cycle: of two equally good ones, prefer the quicker."""

STEP_SIZE = 0.2
"""Standard deviation of the first trials, in logarithms of times and peaks."""

SCATTER = 1e-3
"""Standard deviation of alpha in the trial elements."""

LARGEST = actuator(1).max_strain
"""Greatest peak to try."""

DIMENSIONS = 7
"""Coordinates of a point."""

Off = tuple[float, float]
"""Relative changes of the peak and of the times."""


def ring(directions: int, *radii: float) -> list[Off]:
    """Return changes in as many directions, each in turn at one of the radii."""
    angles = (2.0 * math.pi * k / directions for k in range(directions))
    return [(r * math.cos(a), r * math.sin(a)) for a, r in zip(angles, itertools.cycle(radii))]


TRIALS = ((0.0, 0.0), *ring(24, 0.1, 0.2, 0.3, 0.38))
"""The changes under which a move is judged."""


@dataclass(frozen=True)
class MoveTask:
    """The task of a stroke or a throw.

    Attributes:
        starts: Levels from which it must work.
    """

    design: Design
    starts: Sequence[int]

    def cost(self, move: StrokeSettings | ThrowSettings) -> float:
        """Return the fraction that fails with peak and times off, plus a little for its time."""
        share = [self.lost(move, off, seed) for seed, off in enumerate(TRIALS)]
        return float(np.mean(share)) + PRICE * duration(move) * self.design.eta

    def lost(self, move: StrokeSettings | ThrowSettings, off: Off, seed: int) -> float:
        """Return the fraction of starts that fails.

        Peak and times are off by relative changes; the seed is that of the trial element.
        """
        changed = stretched(move, 1.0 + off[0], 1.0 + off[1])
        specimen = scattered(self.design, Scatter(alpha=SCATTER), seed)
        total = 0.0
        for start in self.starts:
            if isinstance(changed, ThrowSettings):
                peak, target = changed.peak, None
            else:
                peak = stroke_peak(self.design, changed, start)
                target = start - changed.levels
            after = configuration_after(specimen, Cycle.planned(changed, peak), start, dt=COARSE)
            total += 1.0 if after is None else self._wrong(after, target)
        return total / len(self.starts)

    def _wrong(self, after: Array, target: int | None) -> float:
        """Return 0 for a wall at the target, or a blank element for None; 1 if it is lost."""
        low, high = self.design.wells
        found = walls(self.design, after)
        if not (after.min() > low and after.max() < high and len(found) <= 1):
            return 1.0
        if target is None:
            return CLUMSY * len(found) if after[-1] < self.design.D_barrier else 1.0
        if not found or not found[0].anti_kink:
            return 1.0
        away = abs(found[0].position - self.design.defect(target))
        return 0.0 if away < 1.0 else 0.5 + 0.5 * min(1.0, away / (2.0 * self.design.J))


def stretched(move: Move, peak: float, time: float) -> Move:
    """Return a stroke or a throw with factors on its peak and on all its times."""
    times = ('ramp', 'hold', 'ease', 'release', 'settle')
    changed = {name: getattr(move, name) * time for name in times}
    return replace(move, peak=move.peak * peak, **changed)


def duration(move: StrokeSettings | ThrowSettings) -> float:
    """Return the time that it takes."""
    return Cycle.planned(move, move.peak).duration


def search(task: MoveTask, begin: Move, *, trials: int, tick: float = 20.0) -> Move:
    """Return the best stroke or throw found, the same one every time.

    Sign, levels and rest of the beginning are kept; every part except `ease` is a whole number of
    ticks.

    Raises:
        ImportError: The package cmaes is missing.
    """
    from cmaes import CMA

    best, least = begin, task.cost(begin)
    optimizer = CMA(mean=np.zeros(DIMENSIONS), sigma=STEP_SIZE, seed=0)
    for _ in range(math.ceil(trials / optimizer.population_size)):
        points = [optimizer.ask() for _ in range(optimizer.population_size)]
        tried = [point(begin, x, tick) for x in points]
        costs = [task.cost(each) for each in tried]
        optimizer.tell(list(zip(points, costs, strict=True)))
        if min(costs) < least:
            least = min(costs)
            best = tried[costs.index(least)]
    return best


def point(begin: Move, x: Array, tick: float) -> Move:
    """Return the stroke or throw at a point of the search; at 0 the beginning.

    Args:
        begin: Whose times and peak are multiplied by exp(x).
        x: Of ramp, hold, ease, release and peak; then what is added to ease_to and, of a stroke,
            to growth; shape (7,).
        tick: The unit of ramp, hold and release.
    """
    ramp, hold, ease, release, peak = np.exp(x[:5]).tolist()
    growth: dict[str, Any] = {}
    if isinstance(begin, StrokeSettings):
        growth['growth'] = round(float(np.clip(begin.growth + x[6], 0.0, 3.0)), 3)
    return replace(
        begin,
        ramp=max(1, round(begin.ramp * ramp / tick)) * tick,
        hold=round(begin.hold * hold / tick) * tick,
        ease=float(max(1, round(begin.ease * ease))),
        ease_to=round(float(np.clip(begin.ease_to + 0.5 * x[5], -1.0, 1.0)), 3),
        release=max(1, round(begin.release * release / tick)) * tick,
        peak=round(float(np.clip(begin.peak * peak, -LARGEST, LARGEST)), 4),
        **growth,
    )


EASE_TO = -0.1
PEAK = 0.135
"""Of a throw: nine tenths of what the actuators of the presets give."""

FAR = 2.3
"""`reach` from which a throw takes the wall out."""

WIDE = 1.4
"""Least ratio of the release time too slow for that reach to that too fast for the cells."""

BETWEEN = 0.4
"""Where a throw's time lies between the two, as an exponent: 0 is too fast, 1 too slow."""

LONG = 225
"""Number of cells from which far walls need repeated pulses, of falling strength."""

SAMPLE = 5
"""Most levels that a search begins from."""


def going_back(design: Design, settings: Settings) -> Settings:
    """Return settings with strokes and a throw, as far as a law or a window is known.

    Peaks of strokes fall with the site by the law of nine cells to a level. A throw's release time
    lies between too fast for the far end and too slow for the wall.
    """
    usual = design.J == 9 and design.eta == 1 / 250
    back: dict[str, Any] = by_9(design.levels, design.N, design.eta) if usual else {}
    change = (1.0 - EASE_TO) * PEAK
    fast, slow = shortest_ease(design, change), reach(design, change, 1.0) / FAR
    if slow >= WIDE * fast:
        more: dict[str, Any] = {'mirrored': 0.8, 'levels': 10} if design.N > LONG else {}
        ease = float(round(fast * (slow / fast) ** BETWEEN))
        back['throw'] = throw(PEAK, 400.0, ease, EASE_TO, 700.0, **more)
        back['erase'] = replace(settings.erase, method='pulse')
    if back:
        back['actuator'] = actuator(design.N)
    return replace(settings, **back)


def searched(design: Design, settings: Settings, trials: int) -> Settings:
    """Return settings with the best strokes down and throw found by search from theirs, and with
    kicks and a push for this element.

    A stroke or throw that the settings lack is not sought.

    Raises:
        ImportError: The package cmaes is missing.
    """
    last = design.levels - 1
    found: dict[str, Any] = {}
    starts = {
        'down_even': range(0, last + 1, 2), 'down_odd': range(1, last + 1, 2),
        'throw': range(last + 1),
    }  # fmt: skip
    for name, levels in starts.items():
        begin = getattr(settings, name)
        if begin.peak:
            lowest = 0 if name == 'throw' else max(begin.lowest, begin.levels)
            task = MoveTask(design, _some([each for each in levels if each >= lowest]))
            found[name] = search(task, begin, trials=trials, tick=settings.time.tick)
    return replace(settings, **found, **strainless(design, settings))


def strainless(design: Design, settings: Settings) -> dict[str, Any]:
    """Return kicks and a push for an element, with what they bear; 0 where no kick leads."""
    chain, shape = bare(Specimen(design), settings), replace(settings.kick, late=LATE)
    kicks = search_kicks(chain, shape, settings.transducer.max_speed)
    speeds = ' '.join(f'{kick.speed:g}' for kick in kicks)
    rooms = ' '.join(f'{kick.room:g}' for kick in kicks)
    levels = _some(range(design.levels))
    push, room = search_push(chain, settings.push, levels, settings.transducer.max_amplitude)
    return {
        'kick': replace(shape, speeds=speeds, rooms=rooms),
        'push': replace(push, room=round(room, 3)),
    }


def _some(levels: Sequence[int]) -> list[int]:
    """Return as many of the levels as are tried, first and last among them."""
    places = np.linspace(0, len(levels) - 1, min(SAMPLE, len(levels)))
    return [levels[round(place)] for place in places]
