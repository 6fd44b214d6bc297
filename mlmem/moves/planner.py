# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The fastest route of moves from one content to another.

Contents are the nodes of a graph, and moves are its edges. A write takes the shortest path.
"""

from __future__ import annotations

import heapq
import itertools
import pkgutil
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import cache
from importlib import import_module

from ..errors import ProcedureFailed
from ..physics import Design
from ..readers.reading import BLANK, UNDECODABLE, describe_level
from ..settings import Settings
from .move import MIN_MARGIN, Move, blank_content


@cache
def move_families() -> tuple[Callable[[Design, Settings, int, int], Iterator[Move]], ...]:
    """Return the functions `moves_from` of the modules beside this one, in order of name."""
    package = import_module(__package__)
    names = sorted(module.name for module in pkgutil.iter_modules(package.__path__))
    modules = [
        import_module(f'{__package__}.{name}')
        for name in names
        if f'{__package__}.{name}' != __name__
    ]
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


def is_strainless(design: Design, settings: Settings, contents: Iterable[int]) -> bool:
    """Return whether strain is avoided, and some contents are written and erased without it."""
    erases = any(not move.needs_actuator for move in erasing_moves(design, settings))
    if not (settings.write.avoids_strain and erases):
        return False
    blank = blank_content(settings)
    routes = [find_route(design, settings, blank, content) for content in contents]
    return not any(move.needs_actuator for route in routes for move in route)


def _all_moves(design: Design, settings: Settings, start: int, target: int) -> list[Move]:
    return [move for family in move_families() for move in family(design, settings, start, target)]


def find_reachable_levels(design: Design, settings: Settings) -> set[int]:
    """Return the levels, and `BLANK`, to which moves lead from a blank element."""
    found, places = {BLANK}, [BLANK]
    while places:
        targets = {move.target for move in find_moves(design, settings, places.pop())} - found
        found |= targets
        places += targets
    return found


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
