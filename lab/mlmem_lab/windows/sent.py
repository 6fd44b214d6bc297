# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The windows of kicks and pushes: how far every quantity of each may be off.

A kick to every level begins at a blank element at rest, a push at a wall that rests at a level; as
shipped, and with one quantity off by more and more until the wall ends elsewhere.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

from rich.table import Table

from mlmem.element_file import Element
from mlmem.moves.planner import NARROW, How, kick_speed, pushes
from mlmem.physics import Specimen
from mlmem.readers.reading import BLANK
from mlmem_ros.parameter_file import load
from mlmem_tools.cli.output import plain_table

from .flight import FARTHEST, QUANTITIES, after_kick, after_push, bare, kick_rooms, push_rooms


@dataclass(frozen=True)
class Sent:
    """A kick or a push and its window.

    Attributes:
        how: Which of both.
        level: Level to which the kick leads, or from which the push takes the wall.
        speed: Mean speed of a kick; of a push its greatest.
        duration: Of the motion, in time units.
        used: Whether writes use it.
        rooms: Least change of each of `QUANTITIES` at which it fails, `FARTHEST` if none was seen;
            all are 0 if it fails as shipped.
    """

    how: How
    level: int
    speed: float
    duration: float
    used: bool
    rooms: dict[str, float]

    @property
    def fails(self) -> bool:
        """Whether it fails as shipped."""
        return not any(self.rooms.values())

    def as_dict(self) -> dict[str, Any]:
        """Return it for a result file."""
        return {**vars(self), 'how': self.how.value}


def moves(source: str) -> list[tuple[How, int]]:
    """Return all kicks and pushes of a preset or a parameter file, with their levels."""
    design, settings = load(source)
    kicked = [(How.KICK, level) for level, speed in enumerate(settings.kick.by_level) if speed]
    pushed = [(How.PUSH, level) for level in range(design.levels) if settings.push.A]
    return [each for each in kicked if each[1] < design.levels] + pushed


def measured(
    source: str, how: How, level: int, integrator: str = '', element: Element | None = None
) -> Sent:
    """Return the window of a kick or a push.

    Args:
        source: The preset or parameter file.
        integrator: In place of its own.
        element: An element of it with its plan; None for one exactly as designed.
    """
    design, settings = load(source)
    time = replace(settings.time, integrator=integrator or settings.time.integrator)
    settings = replace(settings, time=time)
    chain = bare(Specimen(design) if element is None else element.timed, settings)
    kick, push = settings.kick, settings.push
    if how is How.PUSH:
        sound = after_push(chain, level, push, push.pulses) == BLANK
        rooms = push_rooms(chain, level, push, pulses=push.pulses) if sound else _none(how)
        unstrained = replace(settings, write=replace(settings.write, method='kick'))
        return Sent(how, level, push.speed, 12.0 * push.sigma, pushes(unstrained), rooms)
    factor = 1.0 if element is None else element.pulses(settings)[level].speed
    speeds = [factor * speed for speed in kick.by_level]
    kick = replace(kick, speeds=' '.join(f'{speed:.6g}' for speed in speeds))
    sound = after_kick(chain, speeds[level], kick) == level
    rooms = kick_rooms(chain, level, kick) if sound else _none(how)
    able = kick_speed(design, settings, level) > 0.0 and kick.room(level) >= NARROW
    duration = abs(design.D_s2 - design.D_s1) / speeds[level] + kick.hold
    return Sent(how, level, speeds[level], duration, able, rooms)


def _none(how: How) -> dict[str, float]:
    return dict.fromkeys(QUANTITIES[how.value], 0.0)


NAMES = {'gain': 'stroke', 'omega_c': 'carrier', 'sigma': 'length'}
"""Quantities as the table calls them."""


def table(name: str, how: How, some: Iterable[Sent]) -> Table:
    """Return a row for every kick or push of a preset."""
    of = QUANTITIES[how.value]
    told = [NAMES.get(each, each) for each in of]
    if how is How.PUSH:
        told[0] = 'amplitude'
    made = plain_table(
        f'{name}: {"kicks" if how is How.KICK else "pushes"}, and the changes they bear', '>level',
        '>mean speed' if how is How.KICK else '>highest speed', '>duration',
        *(f'>± {each}' for each in told), 'used',
    )  # fmt: skip
    for each in some:
        rooms = (f'{"> " * (room >= FARTHEST)}{room:g}' for room in each.rooms.values())
        used = 'fails' if each.fails else 'yes' if each.used else 'no'
        made.add_row(str(each.level), f'{each.speed:.4g}', f'{each.duration:.0f}', *rooms, used)
    return made
