# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Kicks: smooth moves of the left end to its other ground state, which need no strain.

A kick sends a wall to the level that its speed selects, or a kink that takes the wall of an
element away. Into a register it sends walls and kinks in turn, each behind those that rest
already; so a word is filled from the right. See docs/strainless.md.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import Checked, ProcedureFailed
from ..instrument.blocks import Procedure, catch_up, move_end, wait
from ..instrument.end import End
from ..physics import Design
from ..physics.values import Array
from ..readers.calibration import PulseCorrection
from ..readers.reading import BLANK, UNDECODABLE, Reading
from ..readers.words import Code
from ..schema import describe_field, describe_time
from .move import Drive, Move, bring_ends_back
from .strain_cycle import ringing_time

if TYPE_CHECKING:
    from ..memory import Memory
    from ..settings import Settings


def _parse_numbers(text: str) -> tuple[float, ...]:
    return tuple(map(float, text.split()))


def _describe_levels(text: str, least: str = '1e-4') -> Any:
    """Return a field of numbers, one for each level from 0 on."""
    return describe_field(
        '',
        text,
        words=f'0 or from {least} to 10',
        word=lambda word: not float(word) or float(least) <= float(word) <= 10.0,
    )


@dataclass(frozen=True)
class KickSettings(Checked):
    """The motions of the left end that need no strain.

    One sends a wall from blank to the level that its speed selects. The opposite one erases: it
    sends a kink that meets the wall at any level, and both are gone.
    """

    speeds: str = _describe_levels(
        'mean speed in cells/time for every level, separated by spaces; 0: no kick to this level'
    )
    kinks: str = _describe_levels('the same for kinks of a register')
    speed_margins: str = _describe_levels(
        'relative margin of the speed of every level; one below 0.1 disables its level',
        least='0',
    )
    late: float = describe_field(
        0.0,
        'when the end is fastest: 0 half-way through the motion, 1 latest',
        low=0.0,
        high=1.0,
    )
    hold: float = describe_time(20.0, 'hold at the other ground state')
    settle: float = describe_time(800.0, 'wait until the wall stops at its level')
    erase_speed: float = describe_field(
        0.3,
        'mean speed of the kick that erases one wall from any level; 0: no kick erases',
        unit='cells/time',
        low=0.0,
        high=10.0,
    )
    erase_settle: float = describe_time(1400.0, 'wait after that kick before the next one')

    @cached_property
    def peak_speed_ratio(self) -> float:
        """Highest speed of a kick, relative to its mean: 1.5 if it is fastest half-way."""
        times = np.arange(1001) / 1000.0
        return float(KickMotion(0.0, 1.0, 1.0, self).evaluate_motion(times)[1].max())

    @cached_property
    def wall_speeds(self) -> tuple[float, ...]:
        """Mean speeds of walls by level; 0 where there is no kick."""
        return _parse_numbers(self.speeds)

    @cached_property
    def kink_speeds(self) -> tuple[float, ...]:
        """Mean speeds of kinks by level."""
        return _parse_numbers(self.kinks)

    def wall_speed(self, level: int) -> float:
        """Mean speed of the kick of a wall to a level; 0 if there is none."""
        return self.wall_speeds[level] if level < len(self.wall_speeds) else 0.0

    @property
    def erases(self) -> bool:
        """Whether an element that is written by kicks is erased by them, too."""
        return any(self.wall_speeds) and self.erase_speed > 0.0

    def scale_speeds(self, walls: Iterable[float], kinks: Iterable[float]) -> KickSettings:
        """Return settings with factors on the speeds of walls and of kinks, by level."""
        speeds, kink_speeds = (
            ' '.join(f'{factor * speed:.6g}' for factor, speed in zip(factors, each, strict=False))
            for factors, each in ((walls, self.wall_speeds), (kinks, self.kink_speeds))
        )
        return replace(self, speeds=speeds, kinks=kink_speeds)

    def speed_margin(self, level: int) -> float:
        """Relative change of the speed that the kick to a level tolerates; 1 if not known."""
        margins = _parse_numbers(self.speed_margins)
        return margins[level] if level < len(margins) else 1.0


@dataclass(frozen=True)
class KickMotion:
    """A smooth move from one ground state to the other, which launches a wall; its mean speed
    selects the level at which that stops.

    It is 3 x^2 - 2 x^3 of a clock x that itself begins slowly: (1 - late) s + late s^2.

    Attributes:
        speed: Mean speed; the highest is `shape.peak_speed_ratio` times that.
        shape: How late it is fastest, and how long the cell is held at its target.
    """

    start: float
    target: float
    speed: float
    shape: KickSettings

    @property
    def duration(self) -> float:
        """Time for which the cell is held, in time units."""
        return abs(self.target - self.start) / self.speed + self.shape.hold

    def evaluate_motion(self, t: Array) -> Array:
        """Return displacement and velocity at times t."""
        way, late = self.target - self.start, self.shape.late
        rate = self.speed / abs(way) if way else 0.0
        s = np.minimum(t * rate, 1.0)
        x, clock = s + late * s * (s - 1.0), 1.0 + late * (2.0 * s - 1.0)
        return np.stack(
            (self.start + way * x * x * (3.0 - 2.0 * x), 6.0 * way * rate * x * (1.0 - x) * clock)
        )


def kick_in(level: int, speed: float, element: Memory, how: Drive) -> Procedure[None]:
    """Kick a wall from the left end of a blank element to a level, at a mean speed of the end
    without corrections.
    """
    yield from catch_up(element)  # where is the end?
    factor = how.corrections[level].speed * how.speed_factor
    yield from kick_to(element, element.design.D_s2, factor * speed)


def kick_word_out(start: int, element: Memory, how: Drive) -> Procedure[Reading]:
    """Kick all walls out of a register that rest at the start, the nearest to the left end first,
    and read; do so again with what was read.

    Each kick sends the opposite wall to the level below the nearest one. Neighbours attract and
    annihilate.

    Raises:
        ProcedureFailed: The element is not blank after as many turns as there are levels.
    """
    design, kick = element.design, element.settings.kick
    code, content = Code(design.levels, element.settings.register.spacing), start
    for _ in range(design.levels):
        # of what is not known, one wall
        walls = code.walls(content) if content != UNDECODABLE else (0,)
        for number, level in enumerate(walls):
            resting = len(walls) - number
            # Factors from 0.85 to 1 on the speed to the level below erased all words at 3 % of
            # scatter.
            speeds = (kick.wall_speeds, kick.kink_speeds)[resting % 2]
            speed = 0.85 * speeds[max(0, level - 1)] if resting > 1 else kick.erase_speed
            yield from kick_to_other_phase(element, speed, kick.erase_settle)
        reading = yield from element.reader.read_after_move(element)
        if (content := reading.level) == 0:
            return reading
    raise ProcedureFailed(
        f'the element is not blank after {design.levels} turns of kicks; read last: '
        f'{element.describe_content(content)}',
    )


def moves_from(design: Design, settings: Settings, start: int, target: int) -> Iterator[Move]:
    """Yield the kicks that begin at a content; into a register the one that its target needs."""
    if settings.holds_words:
        yield from _word_kicks(design, settings, start, target)
        if start != 0 and not settings.clearing_pulse.A:
            each = _erase_duration(design, settings.kick)
            duration = design.levels / settings.register.spacing * each
            out = partial(kick_word_out, start)
            yield Move('kick out', start, 0, duration, out, listens=True)
    elif settings.write.uses_kicks:
        if start == BLANK:
            shape, ringing = settings.kick, ringing_time(design)
            for level in range(design.levels):
                if speed := kick_speed(design, settings, level):
                    duration = kick_duration(design, shape, speed, shape.settle)
                    kick, margin = partial(kick_in, level, speed), shape.speed_margin(level)
                    yield Move('kick', start, level, duration, kick, ringing, margin)
        elif settings.kick.erases and _can_kick(design, settings, settings.kick.erase_speed):
            duration = _erase_duration(design, settings.kick)
            yield Move(
                'kick out', start, BLANK, duration,
                lambda element, how: kick_out(element), ringing_time(design),
            )  # fmt: skip


def kick_duration(design: Design, shape: KickSettings, speed: float, settle: float) -> float:
    """Return the time of a kick of this mean speed, with its rest."""
    return abs(design.D_s2 - design.D_s1) / speed + shape.hold + settle


def _erase_duration(design: Design, shape: KickSettings) -> float:
    return kick_duration(design, shape, shape.erase_speed, shape.erase_settle)


def _word_kicks(design: Design, settings: Settings, start: int, target: int) -> Iterator[Move]:
    """Yield the kick of the next wall of a word, if all walls that rest already are its own."""
    if start == UNDECODABLE:
        return
    code, shape = Code(design.levels, settings.register.spacing), settings.kick
    resting, needed = code.walls(start), code.walls(target)
    missing = len(needed) - len(resting)
    if missing <= 0 or needed[missing:] != resting:
        return
    level = needed[missing - 1]
    speed = (shape.wall_speeds, shape.kink_speeds)[len(resting) % 2][level]
    duration = kick_duration(design, shape, speed, shape.settle)
    yield Move(
        'kick', start, code.word(needed[missing - 1 :]), duration,
        lambda element, how: kick_to_other_phase(element, speed),
    )  # fmt: skip


def kick_speed(design: Design, settings: Settings, level: int) -> float:
    """Return the mean speed of the kick from blank to a level; 0 if there is none."""
    speed = settings.kick.wall_speed(level)
    return speed if _can_kick(design, settings, speed) else 0.0


def remove_missed_kicks(settings: Settings, corrections: Sequence[PulseCorrection]) -> Settings:
    """Return settings without the kicks that do not arrive: those corrected to a speed of 0."""
    if all(correction.speed for correction in corrections):
        return settings
    speeds = [
        speed if level >= len(corrections) or corrections[level].speed else 0.0
        for level, speed in enumerate(settings.kick.wall_speeds)
    ]
    kick = replace(settings.kick, speeds=' '.join(map(str, speeds)))
    return replace(settings, kick=kick)


def _can_kick(design: Design, settings: Settings, speed: float) -> bool:
    """Return whether the transducer can kick at a mean speed."""
    stroke, limits = abs(design.D_s2 - design.D_s1), settings.transducer
    fastest = settings.kick.peak_speed_ratio * speed
    return stroke <= limits.max_stroke and fastest <= limits.max_speed


def kick_out(element: Memory) -> Procedure[None]:
    """Send a kink from the left end to the wall, which takes both away.

    If the left end is inactive, there is a kink already, which did not arrive: first a wall is
    sent to it. A wall that ran past the right end is kicked back in by that end, which needs a
    transducer there.
    """
    design, settings = element.design, element.settings.kick
    yield from bring_ends_back(element)
    if element.phase(End.LEFT) == 0:
        yield from kick_to(element, design.D_s2, max(settings.wall_speeds))
        yield from bring_ends_back(element)
    if element.phase(End.RIGHT) != 0 and not element.settings.has_one_transducer:
        # a wall ran past this end, which kicks it back in
        yield from kick_to(element, design.D_s1, speed=0.5, end=End.RIGHT)
    yield from kick_to(element, design.D_s1, settings.erase_speed, settings.erase_settle)


def kick_to_other_phase(
    element: Memory, speed: float, settle: float | None = None
) -> Procedure[None]:
    """Send a wall, or a kink if the left end is active; see `kick_to`."""
    yield from bring_ends_back(element, (End.LEFT,))
    design = element.design
    target = design.D_s1 if element.phase(End.LEFT) == 1 else design.D_s2
    yield from kick_to(element, target, speed, settle)


def kick_to(
    element: Memory,
    target: float,
    speed: float,
    settle: float | None = None,
    end: End = End.LEFT,
) -> Procedure[None]:
    """Move an end smoothly to a ground state and hold it; what it sends comes to rest.

    `settle` is the rest afterwards, by default that of the settings.
    """
    settings = element.settings.kick
    element.begin_cycle('kicked')
    speed = min(speed, element.settings.transducer.max_speed / settings.peak_speed_ratio)
    start = element.transducer.find_displacement(end)
    yield from move_end(element, end, KickMotion(start, target, speed, settings))
    element.last_moved = element.ticks
    yield from wait(element, settings.settle if settle is None else settle)
