# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One element as chance makes it: every level read from both ends, every step up tried once.

Each level is tried for itself: the wall is put where it rests in this element (by Newton's
method), read, and driven on by one strain cycle. So one element gives a sample of every step
and of every read, and a step that fails spoils no other.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Generator
from dataclasses import dataclass
from typing import TypeVar

from ...device import UNDECODABLE, MemoryElement
from ...device.errors import ProcedureFailed
from ...device.procedures.blocks import cycle
from ...device.procedures.listening import probe
from ...device.settings import Settings, TimeSettings
from ...device.transducer import ENDS
from ...physics import Design, Scatter, Specimen, StateError, scattered
from ...physics.equilibrium import resting_wall
from ..trace import level_of
from ..trial import blank_element

T = TypeVar('T')

TICK = 100.0
"""A long tick: procedures wait by ticks, and the material is the same."""


@dataclass(frozen=True)
class ElementTrial:
    """What one element did.

    Attributes:
        stepped: For every level but the last, whether one strain cycle took the wall from it to
            the next: one wall, nearer to that defect than to any other. False where the level
            pins no wall.
        read: By end, for every level, the level that was decoded.
    """

    stepped: tuple[bool, ...]
    read: dict[str, tuple[int, ...]]


def try_element(design: Design, settings: Settings, scatter: Scatter, seed: int) -> ElementTrial:
    """Make an element by chance and try it.

    It is read with the calibration of the ideal element: it has none of its own.

    Args:
        design: What was meant to be made.
        settings: The instrument's.
        scatter: Standard deviations of what chance decides.
        seed: Of the element: the same gives the same trial.

    Raises:
        DesignError: The element cannot be simulated with the step of the ideal one.
    """
    settings = dataclasses.replace(settings, time=TimeSettings(tick=TICK))
    element = blank_element(design, settings)
    specimen = scattered(design, scatter, seed)
    element.chain.become(specimen)
    stepped: list[bool] = []
    read: dict[str, list[int]] = {end: [] for end in ENDS}
    for level in range(design.levels):
        pinned = _place(element, specimen, level)
        for end, decoded in read.items():
            decoded.append(_decoded(element, end) if pinned else UNDECODABLE)
        if level + 1 < design.levels:
            stepped.append(pinned and _step(element, level))
    return ElementTrial(tuple(stepped), {end: tuple(decoded) for end, decoded in read.items()})


def _place(element: MemoryElement, specimen: Specimen, level: int) -> bool:
    """Put the wall at rest at a level, and return whether the element pins it there."""
    try:
        element.chain.place(resting_wall(specimen, level))
    except StateError:
        return False
    element.transducer.settle()
    return True


def _step(element: MemoryElement, level: int) -> bool:
    """Drive the wall on by one strain cycle, and return whether it is at the next level."""
    times = element.settings.write
    peak = times.compression if element.design.freed_by_compression(level) else times.tension
    _carry_out(element, cycle(element, peak, times))
    design = element.design
    # With scatter a wall rests some cells beside its defect; what counts is the nearest level.
    return level_of(design, element.chain.configuration, design.J / 2) == level + 1


def _decoded(element: MemoryElement, end: str) -> int:
    try:
        return _carry_out(element, probe(element, end)).level
    except ProcedureFailed:  # it does not come to rest
        return UNDECODABLE


def _carry_out(element: MemoryElement, steps: Generator[None, None, T]) -> T:
    """Advance an element through a procedure and return what it gives."""
    while True:
        try:
            next(steps)
        except StopIteration as stop:
            result: T = stop.value
            return result
        element.advance()
