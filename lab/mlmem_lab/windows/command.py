# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem windows`: measure how far every kick may be off.

A kick to every level begins at a blank element at rest, a kick that erases at a wall that rests at
a level. Each is run on a bare chain as shipped, and with one quantity off by more and more, up to
0.3, until the wall ends elsewhere.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import partial

from rich.table import Table

from mlmem.element_file import Element
from mlmem.moves.kick import Kick, KickOut, kick_into, kick_out_of
from mlmem.moves.planner import find_moves
from mlmem.physics import Specimen
from mlmem.presets import load_preset
from mlmem.readers.reading import BLANK
from mlmem.settings import RegisterSettings
from mlmem_tools.cli.command import (
    ELEMENT_OPTION,
    JOBS_OPTION,
    JSON_OPTION,
    declare_command,
    declare_option,
    load_element_option,
)
from mlmem_tools.cli.output import create_console, create_table, print_failure, print_json

from ..study import count_cores, map_calls
from .flight import (
    FARTHEST,
    KICK_QUANTITIES,
    after_erase,
    after_kick,
    build_chain,
    erase_margins,
    kick_margins,
)

NO_MARGINS = dict.fromkeys(KICK_QUANTITIES, 0.0)
"""Of a kick that fails as shipped."""


@dataclass(frozen=True)
class KickWindow:
    """A kick and its window.

    Attributes:
        how: Name of the move.
        level: Level to which the kick leads, or which it erases.
        speed: Its mean speed.
        duration: Of the motion, in time units.
        used: Whether writes use it.
        rooms: Least change of each of `KICK_QUANTITIES` at which it fails, `FARTHEST` if none was
            seen; all are 0 if it fails as shipped.
    """

    how: str
    level: int
    speed: float
    duration: float
    used: bool
    rooms: dict[str, float]

    @property
    def fails(self) -> bool:
        """Whether it fails as shipped."""
        return not any(self.rooms.values())


@declare_command(
    'measure how far every kick may be off',
    declare_option('presets', nargs='+', metavar='FILE|PRESET', help='element files, or presets'),
    ELEMENT_OPTION,
    JOBS_OPTION,
    JSON_OPTION,
    text=__doc__,
)
def windows(arguments: argparse.Namespace) -> int:
    """Measure; return 0, 1 if a kick fails as shipped, 2 if misused."""
    presets = arguments.presets
    try:
        first, *_ = [load_preset(name) for name in presets]
        element = load_element_option(arguments, *first)
    except ValueError as error:
        return print_failure('windows', error, 2)
    if element is not None and len(presets) != 1:
        return print_failure('windows', '--element needs the one preset that it is of', 2)
    tasks = [(name, move) for name in presets for move in list_kicks(name)]
    if not tasks:
        return print_failure('windows', f'{presets[0]} has no kicks', 2)
    console = create_console(aside=arguments.json)
    measure = partial(measure_window, element=element)
    done = map_calls(
        console, arguments.jobs or count_cores(), 'kicks', measure, *zip(*tasks, strict=True)
    )
    found: dict[str, list[KickWindow]] = {name: [] for name in presets}
    for (name, _), window in zip(tasks, done, strict=True):
        found[name].append(window)
    for name, some in found.items():
        for how in (Kick.name, KickOut.name):
            if of_kind := [each for each in some if each.how == how]:
                console.print(build_table(name, how, of_kind))
    if arguments.json:
        print_json({name: [vars(each) for each in some] for name, some in found.items()})
    return int(any(each.fails for each in done))


def list_kicks(source: str) -> list[Kick | KickOut]:
    """Return all kicks of a preset or an element file, whether or not writes use them."""
    design, settings = load_preset(source)
    kick, levels = settings.kick, range(design.levels)
    found: list[Kick | KickOut] = [
        kick_into(design, settings, level)
        for level, speed in zip(levels, kick.wall_speeds, strict=False)
        if speed
    ]
    if found and kick.erase_speed:
        found += [kick_out_of(design, settings, level) for level in levels]
    return found


def measure_window(
    source: str, move: Kick | KickOut, element: Element | None = None
) -> KickWindow:
    """Return the window of a kick.

    Args:
        source: The preset or element file.
        element: An element of it with its plan; None for one exactly as designed.
    """
    design, settings = load_preset(source)
    write, one_wall = replace(settings.write, method='kick'), RegisterSettings()
    settings = replace(settings, write=write, register=one_wall)
    chain = build_chain(Specimen(design) if element is None else element.timed_specimen, settings)
    kick, stroke = settings.kick, abs(design.D_s2 - design.D_s1)
    used = move in find_moves(design, settings, move.start)
    if move.start != BLANK:
        level, speed = move.start, kick.erase_speed
        sound = after_erase(chain, level, kick) == BLANK
        rooms = erase_margins(chain, level, kick) if sound else NO_MARGINS
    else:
        level = move.target
        factor = 1.0 if element is None else element.corrections_by_level(settings)[level].speed
        speeds = [factor * speed for speed in kick.wall_speeds]
        kick, speed = replace(kick, speeds=' '.join(f'{one:.6g}' for one in speeds)), speeds[level]
        sound = after_kick(chain, speed, kick) == level
        rooms = kick_margins(chain, level, kick) if sound else NO_MARGINS
    return KickWindow(move.name, level, speed, stroke / speed + kick.hold, used, rooms)


def build_table(name: str, how: str, some: Iterable[KickWindow]) -> Table:
    """Return a row for every kick of a preset: those that write, or those that erase."""
    told = ['stroke' if each == 'gain' else each for each in KICK_QUANTITIES]
    kind = 'kicks' if how == Kick.name else 'kicks that erase'
    made = create_table(
        f'{name}: {kind}, and the changes they bear', '>level', '>mean speed', '>duration',
        *(f'>± {each}' for each in told), 'used',
    )  # fmt: skip
    for each in some:
        rooms = (f'{"> " * (room >= FARTHEST)}{room:g}' for room in each.rooms.values())
        used = 'fails' if each.fails else 'yes' if each.used else 'no'
        made.add_row(str(each.level), f'{each.speed:.4g}', f'{each.duration:.0f}', *rooms, used)
    return made
