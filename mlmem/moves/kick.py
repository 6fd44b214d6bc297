# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Kicks: smooth moves of the left end to its other ground state, which need no strain.

A kick sends a wall to the level that its speed selects, or a kink that takes the wall of an
element away. Into a register it sends walls and kinks in turn, each behind those that rest
already; so a word is filled from the right. See docs/strainless.md.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

from ..errors import ProcedureFailed
from ..instrument.blocks import Procedure, catch_up, wait, wait_for_ends
from ..instrument.end import End
from ..memory import Memory
from ..move_settings import KickSettings
from ..physics import Design
from ..readers.reading import BLANK, UNDECODABLE, Reading
from ..readers.words import Code
from ..settings import Settings
from .ends import bring_ends_back
from .move import Drive, Move
from .strain_cycle import ringing_time


@dataclass(frozen=True)
class KickIn(Move):
    """A kick of a wall from the left end of a blank element to a level; see `Move`.

    Attributes:
        speed: Mean speed of the end, without corrections.
    """

    speed: float = field(kw_only=True)

    name: ClassVar[str] = 'kick'

    def drive(self, element: Memory, how: Drive) -> Procedure[None]:
        """Send the wall; it comes to rest at the level."""
        yield from catch_up(element)  # where is the end?
        factor = how.corrections[self.target].speed * how.speed_factor
        yield from kick_to(element, element.design.D_s2, factor * self.speed)


@dataclass(frozen=True)
class KickOut(Move):
    """A kick of a kink that takes the wall away; see `Move`."""

    name: ClassVar[str] = 'kick out'

    def drive(self, element: Memory, how: Drive) -> Procedure[None]:
        """Send the kink to the wall."""
        yield from kick_out(element)


@dataclass(frozen=True)
class WordKick(Move):
    """A kick of the next wall or kink into a register; see `Move`.

    Attributes:
        speed: Mean speed of the end.
    """

    speed: float = field(kw_only=True)
    margin: float = 1.0

    name: ClassVar[str] = 'kick'

    def drive(self, element: Memory, how: Drive) -> Procedure[None]:
        """Send a wall, or a kink if the left end is active."""
        yield from kick_to_other_phase(element, self.speed)


@dataclass(frozen=True)
class WordKickOut(Move):
    """Kicks that take the walls of a register away, the nearest to the left end first; see `Move`.

    Each sends the opposite wall to the level below the nearest one. Neighbours attract and
    annihilate.
    """

    margin: float = 1.0

    name: ClassVar[str] = 'kick out'
    listens: ClassVar[bool] = True

    def drive(self, element: Memory, how: Drive) -> Procedure[Reading]:
        """Kick all walls out that rest at the start, and read; do so again with what was read.

        Raises:
            ProcedureFailed: The element is not blank after as many turns as there are levels.
        """
        design, kick = element.design, element.settings.kick
        code, content = Code(design.levels, element.settings.register.spacing), self.start
        for _ in range(design.levels):
            # of what is not known, one wall
            walls = code.walls(content) if content != UNDECODABLE else (0,)
            for first in range(len(walls)):
                speed = _kick_out_speed(kick, walls[first:])
                yield from kick_to_other_phase(element, speed, kick.erase_settle)
            reading = yield from element.reader.read(element)
            if element.reader.needs_second_read(reading):
                reading = yield from element.reader.read(element)
            if (content := reading.level) == 0:
                return reading
        raise ProcedureFailed(
            f'the element is not blank after {design.levels} turns of kicks; read last: '
            f'{element.describe_content(content)}',
            code=reading.failure_code,
        )


def _kick_out_speed(kick: KickSettings, walls: Sequence[int]) -> float:
    """Return the speed of the kick that takes away the first of the walls of a word."""
    if len(walls) < 2:  # or what rests is not known
        return kick.erase_speed
    speeds = (kick.wall_speeds, kick.kink_speeds)[len(walls) % 2]
    # Factors from 0.85 to 1 on the speed to the level below erased all words at 3 % of scatter.
    return 0.85 * speeds[max(0, walls[0] - 1)]


def moves_from(
    design: Design, settings: Settings, start: int, target: int
) -> Iterator[KickIn | KickOut | WordKick | WordKickOut]:
    """Yield the kicks that begin at a content; into a register the one that its target needs."""
    if settings.register.spacing:
        yield from _word_kicks(design, settings, start, target)
        if start != 0 and not settings.clearing_pulse.A:
            each = _erase_duration(design, settings.kick)
            yield WordKickOut(start, 0, design.levels / settings.register.spacing * each)
    elif settings.write.method != 'strain':
        if start == BLANK:
            shape, ringing = settings.kick, ringing_time(design)
            for level in range(design.levels):
                if speed := kick_speed(design, settings, level):
                    duration = kick_duration(design, shape, speed, shape.settle)
                    margin = shape.speed_margin(level)
                    yield KickIn(start, level, duration, ringing, margin, speed=speed)
        elif erase_speed(design, settings):
            duration = _erase_duration(design, settings.kick)
            yield KickOut(start, BLANK, duration, ringing_time(design))


def kick_duration(design: Design, shape: KickSettings, speed: float, settle: float) -> float:
    """Return the time of a kick of this mean speed, with its rest."""
    return abs(design.D_s2 - design.D_s1) / speed + shape.hold + settle


def _erase_duration(design: Design, shape: KickSettings) -> float:
    return kick_duration(design, shape, shape.erase_speed, shape.erase_settle)


def _word_kicks(design: Design, settings: Settings, start: int, target: int) -> Iterator[WordKick]:
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
    yield WordKick(start, code.word(needed[missing - 1 :]), duration, speed=speed)


def kick_speed(design: Design, settings: Settings, level: int) -> float:
    """Return the mean speed of the kick from blank to a level; 0 if there is none."""
    speeds, limits = settings.kick.wall_speeds, settings.transducer
    speed = speeds[level] if level < len(speeds) else 0.0
    able = abs(design.D_s2 - design.D_s1) <= limits.max_stroke
    return speed if able and settings.kick.peak_speed_ratio * speed <= limits.max_speed else 0.0


def erase_speed(design: Design, settings: Settings) -> float:
    """Return the mean speed of the kick that erases one wall; 0 if kicks do not erase."""
    kick, limits = settings.kick, settings.transducer
    able = settings.write.method != 'strain' and any(kick.wall_speeds)
    able &= abs(design.D_s2 - design.D_s1) <= limits.max_stroke
    able &= kick.peak_speed_ratio * kick.erase_speed <= limits.max_speed
    return kick.erase_speed if able else 0.0


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
    element.progress.phase = 'launching'
    speed = min(speed, element.settings.transducer.max_speed / settings.peak_speed_ratio)
    element.transducer.kick_end(target, speed, end)
    yield from wait_for_ends(element)
    element.last_moved = element.ticks
    yield from wait(element, settings.settle if settle is None else settle)
