# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a move is: one way to take an element from one content to another; the fastest route of
moves; and how ends that strayed are brought back before they are driven.

Contents are the nodes of a graph, and moves are its edges. A write takes the shortest path.

Every other module of this package with a function `moves_from(design, settings, start, target)`
adds its moves to the graph. That function yields the moves that begin at a content, or, from
`UNDECODABLE`, those that make an element blank whatever it holds. A family may leave out what
leads away from the target. What can be set on its moves stands in the same module; `Settings`
has a field for it.
"""

from __future__ import annotations

import heapq
import itertools
import pkgutil
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any

from ..errors import ProcedureFailed
from ..instrument.blocks import Procedure, catch_up, move_end, wait
from ..instrument.end import End, EndMove
from ..physics import Design
from ..readers.calibration import PulseCorrection
from ..readers.reading import BLANK, UNDECODABLE, describe_level

if TYPE_CHECKING:
    from ..memory import Memory
    from ..settings import Settings

MIN_MARGIN = 0.1
"""Least margin of a move on a route."""


@dataclass(frozen=True)
class Drive:
    """How a write drives its moves.

    Attributes:
        corrections: Of the pulses, by the level to which a move takes the wall.
        strain_factor: Factor on the peak strains of steps up, within the actuator's limit.
        speed_factor: Factor on the speed of a kick, within the transducer's limit.
        is_last: Whether the element is read after this move.
    """

    corrections: Sequence[PulseCorrection]
    strain_factor: float = 1.0
    speed_factor: float = 1.0
    is_last: bool = True


@dataclass(frozen=True)
class Move:
    """One way to take an element from one content to another.

    A content is a level or `BLANK`; of a register it is a word.

    Attributes:
        name: The kind of move in words, for messages.
        start: Content at which it begins; `UNDECODABLE` if any will do.
        target: Content at which it ends.
        duration: Time units that it takes; approximate if it listens.
        drive: Makes it, and returns what it read last if it listens. Raises `ProcedureFailed` if
            it listens and has not succeeded; `NotFollowed` if the actuator does not follow.
        ringing: Time units for which it leaves the element ringing, until it can be read.
        margin: Relative change that its quantities tolerate.
        needs_actuator: Whether it strains the substrate.
        listens: Whether it listens on its way until it has succeeded. It is as fast as it says
            only from a content that was read, so it begins a route.
    """

    name: str
    start: int
    target: int
    duration: float
    drive: Callable[[Memory, Drive], Procedure[Any]]
    ringing: float = 0.0
    margin: float = MIN_MARGIN
    needs_actuator: bool = False
    listens: bool = False


def blank_content(settings: Settings) -> int:
    """Return the content of an element without walls: `BLANK`, or word 0 of a register."""
    return 0 if settings.holds_words else BLANK


def bring_ends_back(element: Memory, ends: Iterable[End] = End) -> Procedure[None]:
    """Move those of some ends that strayed into a third ground state back to the active phase.

    A wall driven over a free end returns as a wall between the active phase and the next. No
    strain moves it, but the wall launched here removes it within some 90 cells.
    """
    yield from catch_up(element)
    for end in ends:
        if element.phase(end) is not None:
            continue
        element.forget_content('an end was brought back')
        start = element.transducer.find_displacement(end)
        # speeds of 0.1 to 0.4 work
        yield from move_end(element, end, EndMove(start, element.design.D_s2, 0.2))
        yield from wait(element, element.settings.erase.settle)
        yield from catch_up(element)


# --- routes -----------------------------------------------------------------------------------


@cache
def move_families() -> tuple[Callable[[Design, Settings, int, int], Iterator[Move]], ...]:
    """Return the functions `moves_from` of the modules beside this one, in order of name."""
    package = import_module(__package__)
    names = sorted(module.name for module in pkgutil.iter_modules(package.__path__))
    modules = [import_module(f'{__package__}.{name}') for name in names]
    return tuple(module.moves_from for module in modules if hasattr(module, 'moves_from'))


def disable_kicks(settings: Settings) -> Settings:
    """Return settings without kicks, if there is an actuator."""
    if not settings.actuator.present:
        return settings
    return replace(settings, write=replace(settings.write, method='strain'))


def find_moves(
    design: Design, settings: Settings, start: int, target: int = BLANK
) -> Iterator[Move]:
    """Yield the moves that begin at a content and can be used on the way to a target.

    A move is not used if its margin is below `MIN_MARGIN`, or if it leads past a stuck cell. An
    element that can be erased without strain is not erased with it: less is left behind that
    brakes a kick.
    """
    found = _all_moves(design, settings, start, target)
    without_strain = any(move.target == BLANK and not move.needs_actuator for move in found)
    for move in found:
        blocked = settings.element.explain_blocked(design.defect_site(move.target))
        superseded = without_strain and move.target == BLANK and move.needs_actuator
        if move.margin >= MIN_MARGIN and not blocked and not superseded:
            yield move


def erasing_moves(design: Design, settings: Settings) -> list[Move]:
    """Return the moves that make an element blank whatever it holds, strained ones last."""
    found = _all_moves(design, settings, UNDECODABLE, BLANK)
    return sorted(found, key=lambda move: move.needs_actuator)


def _all_moves(design: Design, settings: Settings, start: int, target: int) -> list[Move]:
    return [move for family in move_families() for move in family(design, settings, start, target)]


def find_route(design: Design, settings: Settings, start: int, target: int) -> list[Move]:
    """Return the fastest moves from one content to another (Dijkstra); with `write.method` kick,
    those with the least strain.

    Raises:
        ProcedureFailed: There is no way: without an actuator, or past a stuck cell.
    """
    order = itertools.count()
    ways: list[tuple[float, int, int, list[Move]]] = [(0.0, next(order), start, [])]
    seen = set()
    # a strained move seems this much longer, in time units, where strain is avoided
    penalty = 1e9 if settings.write.avoids_strain else 0.0
    while ways:
        time, _, place, way = heapq.heappop(ways)
        if place == target:
            return way
        if place in seen:
            continue
        seen.add(place)
        for move in find_moves(design, settings, place, target):
            if move.listens and place != start:
                continue
            cost = time + move.duration + penalty * move.needs_actuator
            heapq.heappush(ways, (cost, next(order), move.target, [*way, move]))
    if why := settings.element.explain_blocked(design.defect_site(target)):
        raise ProcedureFailed(f'level {target} cannot be reached: {why}')
    raise ProcedureFailed(
        f'{describe_level(target)} is reached only by strain: it needs an actuator, or, with '
        'write.method kick or auto, kicks within the limits of the transducers'
    )
