# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Many walls: kick each to its level, and clear all with one pulse.

A kick needs no strain. It is a smooth move of the left end to its other ground state, and sends a
wall, or a kink behind walls that rest already, to the level that its speed selects. So a word is
filled from the right.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..errors import ProcedureFailed
from ..memory import Memory
from ..physics import Design
from ..readers.echo import pulse_duration
from ..readers.reading import UNDECODABLE
from ..readers.words import Code
from ..settings import Settings
from .blocks import Procedure, Result, bring_ends_back, fire_clearing_pulse, send_wall, wait_time
from .listening import read_waveforms

if TYPE_CHECKING:
    from ..readers.register import Register


def clear_walls(element: Memory) -> Procedure[None]:
    """Bring back ends that strayed, fire the clearing pulse, and let its waves decay."""
    yield from bring_ends_back(element)
    yield from fire_clearing_pulse(element)
    yield from wait_time(element, element.settings.clearing_pulse.settle)


def put_word(element: Memory, register: Register, present: int, word: int) -> Procedure[None]:
    """Bring a word into an element that holds another, open loop.

    Walls stay if none is to their right that must go, and none is missing there. Otherwise all
    are cleared.
    """
    cleared, speeds = plan_word(element.settings, register.code, present, word)
    if cleared:
        yield from clear_walls(element)
    for speed in speeds:
        yield from send_wall(element, speed, speed)


def plan_word(settings: Settings, code: Code, present: int, word: int) -> tuple[bool, list[float]]:
    """Return whether to clear all walls first, and the speeds of the kicks from there on."""
    wanted = code.walls(word)
    kept = () if present == UNDECODABLE else code.walls(present)
    cleared = present == UNDECODABLE or wanted[len(wanted) - len(kept) :] != kept
    first = 0 if cleared else len(kept)
    speeds = settings.kick.wall_speeds, settings.kick.kink_speeds
    return cleared, [speeds[k % 2][wanted[-1 - k]] for k in range(first, len(wanted))]


def kicking_time(design: Design, settings: Settings, cleared: bool, speeds: list[float]) -> float:
    """Return how long `plan_word` takes, in time units."""
    moved = abs(design.D_s2 - design.D_s1)
    kick, pulse = settings.kick, settings.clearing_pulse
    kicks = sum(moved / speed + kick.hold + kick.settle for speed in speeds)
    return kicks + cleared * (pulse_duration(pulse) + pulse.settle)


def clear_and_read(element: Memory) -> Procedure[Result]:
    """Clear all walls, and listen.

    Raises:
        ProcedureFailed: The element is not blank after `write.attempts` pulses.
    """
    attempts = element.settings.write.attempts
    for attempt in range(1, attempts + 1):
        element.progress.tried('erase', attempt)
        yield from clear_walls(element)
        reading = yield from read_waveforms(element)
        if reading.level == 0:
            return Result(reading, attempt)
    raise ProcedureFailed(
        f'the element is not blank after {attempts} pulses: {reading.reason or reading.code}',
        attempts,
    )
