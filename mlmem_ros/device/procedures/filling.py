# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Filling a long register: walls enter at the left end, and all are shifted on at a time.

Compression frees walls at even levels and kinks at odd ones, tension the others. So a wall that is
launched before a compression and a kink that is launched before a tension keep step.

A weak tension frees a kink, and no wall. Then kinks go on until each meets the wall ahead of it,
and both are gone.
"""

from __future__ import annotations

from collections.abc import Sequence

from ...physics import Design
from ..end import End
from ..memory import Memory
from ..motion import Cycle
from ..move_settings import peak
from ..moves import half_period
from ..reading import UNDECODABLE
from ..settings import Settings
from ..words import Code
from .blocks import Procedure, bring_ends_back, play, send
from .listening import wait_for_quiet
from .shifting import HALVES, strain

MORE = 4
"""Cycles beyond those after which the last kink should have met its wall."""


def shift_in(element: Memory, walls: Sequence[int]) -> Procedure[None]:
    """Shift the walls of a word, levels from the left, into a blank element."""
    last = walls[-1] if walls else 0
    launched = {last - level for level in walls}
    for cycle in range(last + 1):
        if cycle in launched:
            yield from enter(element)
        if cycle < last:
            element.begin_cycle()
            yield from strain(element, element.settings, HALVES[cycle % 2], kinks=False)
    yield from wait_for_quiet(element, element.settings.write.final_settle)


def annihilate(element: Memory, code: Code, present: int) -> Procedure[None]:
    """Let every kink meet the wall ahead of it, in an element that holds a word or is unknown."""
    yield from bring_ends_back(element)
    times, rate = element.settings.erase, element.settings.actuator.max_rate
    for cycle in range(passages(code, present)):
        if cycle == 1 and element.phase(End.LEFT) == 1:
            yield from enter(element)
        element.begin_cycle()
        weak = Cycle.planned(times, peak(times, cycle % 2 == 0), rate)
        yield from play(element, weak, half_period(element.design))


def passages(code: Code, present: int) -> int:
    """Return how many cycles it takes until the element is blank; 0 if it is."""
    if present == UNDECODABLE:
        return code.levels + MORE
    if not (walls := code.walls(present)):
        return 0
    places = [-1, *walls] if len(walls) % 2 else list(walls)
    return MORE + max(b - a for a, b in zip(places[::2], places[1::2], strict=True))


def duration(design: Design, settings: Settings, code: Code, present: int, word: int) -> float:
    """Return how long it takes to bring a word into an element that holds another."""
    walls, kick = code.walls(word), settings.kick
    times = [Cycle.planned(each, 0.0).duration for each in (settings.erase, settings.write)]
    moved = abs(design.D_s2 - design.D_s1)
    speeds = (kick.by_level[0], kick.of_kinks[0])
    entering = sum(
        moved / speeds[n % 2] + kick.hold + kick.settle for n in range(len(walls) + (present != 0))
    )
    return passages(code, present) * times[0] + (walls[-1] if walls else 0) * times[1] + entering


def enter(element: Memory) -> Procedure[None]:
    """Send a wall, or a kink if the left end is active, to level 0."""
    kick = element.settings.kick
    yield from send(element, kick.by_level[0], kick.of_kinks[0])
