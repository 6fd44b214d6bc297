# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The window of a step up: how far its peak and its times may be off.

A step is run on a bare chain: no probe, and the wall at rest before. Integrator and step are the
device's, and so is the strain: ramps in two halves if the settings say so, and every
motion begun with a tick. Ten damping times later the wall must be within a cell of its place.

Fixed directions say how far away a failure is; between them there may be one. So changes up to
`MAX_DRAWN_CHANGE` are drawn at random, too, which bound the share of all these that may fail.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from mlmem.element_file import Element
from mlmem.instrument.actuator import Actuator
from mlmem.instrument.drivers import Simulation
from mlmem.moves.corrections import apply_correction
from mlmem.moves.move import Move
from mlmem.moves.planner import find_moves
from mlmem.moves.strain_cycle import StepUp, half_period, step_cycle
from mlmem.physics import Chain, StateError, find_level, substep_times
from mlmem.physics.equilibrium import find_pinned_wall
from mlmem.physics.potential import Array
from mlmem.presets import load_preset
from mlmem.readers.reading import UNDECODABLE
from mlmem.settings import ActuatorSettings, Settings

from ..studies.bench import arrival_tolerance

CHANGE_RADII = (0.05, 0.1, 0.15, 0.2)
"""Relative changes, of peak and of times; of both, the root of the sum of their squares."""

MAX_DRAWN_CHANGE = 0.1
"""Every step of a shipped element bears what is nearer than this."""

PEAK_SETTINGS = ('compression', 'tension')
TIME_SETTINGS = ('ramp', 'hold', 'ease', 'release', 'settle')

DAMPING_TIMES = 10.0
"""Of rest after a move."""

STRONG_ACTUATOR = ActuatorSettings(max_strain=0.5, max_rate=1.0)
"""An actuator that no change asks too much of."""

Off = Mapping[str, float]
"""Relative changes by setting."""


def _build_directions() -> dict[str, Off]:
    """Return unit changes by name: peak and times together, and each part of a cycle alone."""
    found: dict[str, Off] = {}
    for eighth in range(8):
        peak, time = (round(part(math.pi / 4.0 * eighth), 12) for part in (math.cos, math.sin))
        names = [f'{name}{"+" if by > 0.0 else "-"}'
                 for name, by in (('peak', peak), ('times', time)) if by]  # fmt: skip
        found[' '.join(names)] = dict.fromkeys(PEAK_SETTINGS, peak) | dict.fromkeys(
            TIME_SETTINGS, time
        )
    for part in ('ramp', 'ease', 'release'):
        found |= {f'{part}+': {part: 1.0}, f'{part}-': {part: -1.0}}
    return found


UNIT_DIRECTIONS = _build_directions()
"""Unit changes by name."""


@dataclass(frozen=True)
class Failure:
    """A change under which a move ends elsewhere.

    Attributes:
        radius: How far peak and times are off; 0 as shipped.
        direction: Which of `UNIT_DIRECTIONS`, or the change that was drawn; empty as shipped.
        ended: The level where the wall is, `BLANK`, or `UNDECODABLE`.
    """

    radius: float
    direction: str
    ended: int


@dataclass(frozen=True)
class Window:
    """What was found for one move.

    Attributes:
        start: Level at which it begins.
        target: Level at which it should end.
        tried: How many directions were tried at every radius.
        points: How many changes up to `MAX_DRAWN_CHANGE` were drawn.
        failures: Those that failed, nearest first.
    """

    start: int
    target: int
    tried: int
    points: int
    failures: tuple[Failure, ...]

    @property
    def distance(self) -> float:
        """Least radius at which it was seen to fail; infinity if it never was."""
        return self.failures[0].radius if self.failures else math.inf

    def as_dict(self) -> dict[str, Any]:
        """Return it for a result file."""
        return {
            'from': self.start, 'to': self.target, 'tried': self.tried,
            'points': self.points, 'distance': self.distance,
            'failures': [[each.radius, each.direction, each.ended] for each in self.failures],
        }  # fmt: skip


def list_moves(name: str) -> list[Move]:
    """Return the steps up of a preset or element file, from every level."""
    design, settings = load_preset(name)
    levels = range(design.levels)
    return [m for n in levels for m in find_moves(design, settings, n) if m.name == StepUp.name]


def describe_settings(name: str) -> dict[str, Any]:
    """Return the settings of a preset on which its windows depend."""
    _, settings = load_preset(name)
    shown = asdict(settings.write)
    del shown['method']  # which moves are made does not change them
    return {'write': shown}


def measure_window(
    name: str,
    move: Move,
    integrator: str = '',
    radii: tuple[float, ...] = CHANGE_RADII,
    element: Element | None = None,
    points: int = 0,
    seed: int = 0,
) -> Window:
    """Return the window of a step up of a preset.

    Args:
        name: The preset or element file.
        integrator: In place of its own.
        radii: To try, rising.
        element: An element of the preset with its pulses; None for one exactly as designed.
        points: How many changes are drawn.
    """
    design, settings = load_preset(name)
    time = replace(settings.time, integrator=integrator or settings.time.integrator)
    chain = Simulation.of(design if element is None else element.timed_specimen, time).chain
    if element is not None:
        settings = apply_correction(settings, element.corrections_by_level(settings)[move.target])
    eases = bool(settings.write.ease)
    directions = [each for each in UNIT_DIRECTIONS if each[:4] != 'ease' or eases]
    changes: list[tuple[float, str, Off]] = [(0.0, '', {})]
    for radius in radii:
        for each in directions:
            off = {part: radius * share for part, share in UNIT_DIRECTIONS[each].items()}
            changes.append((radius, each, off))
    random = np.random.Generator(np.random.PCG64([seed, move.start]))
    times = [part for part in TIME_SETTINGS if part != 'ease' or eases]
    changes += [_draw_change(random, times, together=number % 2 == 1) for number in range(points)]
    ends = [end_level(chain, settings, move, off) for *_, off in changes]
    failures = [
        Failure(radius, direction, ended)
        for (radius, direction, _), ended in zip(changes, ends, strict=True)
        if ended != move.target
    ]
    failures.sort(key=lambda failure: failure.radius)
    return Window(move.start, move.target, len(directions), points, tuple(failures))


def _draw_change(
    random: np.random.Generator, times: Sequence[str], *, together: bool
) -> tuple[float, str, Off]:
    """Return a change up to `MAX_DRAWN_CHANGE`, any as likely as any other: how far, described,
    and itself.

    It is of the peak, and of all times `together` or each by itself.
    """
    quantities = ['peak', 'times'] if together else ['peak', *times]
    way = random.normal(size=len(quantities))
    radius = MAX_DRAWN_CHANGE * random.random() ** (1.0 / len(quantities))
    by = (radius * way / np.linalg.norm(way)).tolist()
    off = dict.fromkeys(PEAK_SETTINGS, by[0])
    off |= dict.fromkeys(times, by[1]) if together else dict(zip(times, by[1:], strict=True))
    text = ' '.join(f'{name}{one:+.3f}' for name, one in zip(quantities, by, strict=True))
    return round(radius, 4), text, off


def bound_failures(presets: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Return what the drawn changes of a result file say.

    Of a move whose n changes all held, up to 1 - 0.05 ** (1 / n) of all changes may fail (95 %).
    """
    some = [move for each in presets.values() for move in each['moves']]
    failed = [[f for f in move['failures'] if f[1] not in ('', *UNIT_DIRECTIONS)] for move in some]
    missed = [
        found[0][0]
        for move, found in zip(some, failed, strict=True)
        if found
        and not any(f[0] <= MAX_DRAWN_CHANGE and f[1] in UNIT_DIRECTIONS for f in move['failures'])
    ]
    least = min(move['points'] for move in some) if some else 0
    return {
        'radius': MAX_DRAWN_CHANGE,
        'moves': len(some),
        'points': sum(move['points'] for move in some),
        'failures': sum(map(len, failed)),
        'moves that failed': sum(map(bool, failed)),
        'moves that failed in no direction': len(missed),
        'nearest of these': min(missed, default=None),
        'moves in which nothing failed': sum(
            not any(f[0] <= MAX_DRAWN_CHANGE for f in move['failures']) for move in some
        ),
        'share of these, at most (95 %)': 1.0 - 0.05 ** (1.0 / least) if least else 1.0,
    }


def end_level(chain: Chain, settings: Settings, move: Move, off: Off) -> int:
    """Return where a move ends whose settings are off: a level, `BLANK`, or `UNDECODABLE`."""
    design = chain.design
    try:
        chain.place(find_pinned_wall(chain.specimen, move.start))
        chain.advance(strain_sequence(chain, settings, move, off) * design.end_displacement(1.0))
        chain.rest(math.ceil(DAMPING_TIMES / design.eta / chain.dt))
    except StateError:  # driven so hard that the chain diverges
        return UNDECODABLE
    return find_level(design, chain.configuration, arrival_tolerance(chain.specimen))


def strain_sequence(chain: Chain, settings: Settings, move: Move, off: Off) -> Array:
    """Return the strain of a move at the chain's sub-steps, as the device's actuator plays it."""
    design, tick = chain.design, settings.time.tick
    delay = half_period(design) if settings.write.shaped else 0.0
    nominal = step_cycle(design, replace(settings, actuator=STRONG_ACTUATOR), move.start)
    cycle = step_cycle(design, change_settings(settings, off), move.start)
    actuator, pieces, starts = Actuator(STRONG_ACTUATOR), [], [0.0]
    for motion, shipped in zip(cycle.motions, nominal.motions, strict=True):
        actuator.ramp_to(motion.target, motion.duration, delay)
        pieces.append(actuator.motion)
        actuator.hold(motion.target)
        # The next motion begins with a tick.
        slack = math.ceil(shipped.duration / tick) * tick - shipped.duration
        starts.append(starts[-1] + motion.duration + slack)
    times = substep_times(math.ceil(starts[-1] / chain.dt), chain.dt, chain.integrator)
    found = np.zeros_like(times)
    for piece, begin in zip(pieces, starts, strict=False):
        since = times >= begin
        found[since] = piece.strain(times[since] - begin)
    return found


def change_settings(settings: Settings, off: Off) -> Settings:
    """Return settings with relative changes of the step, and an actuator that can follow."""
    write = settings.write
    values: Any = {part: getattr(write, part) * (1.0 + by) for part, by in off.items()}
    return replace(settings, actuator=STRONG_ACTUATOR, write=replace(write, **values))
