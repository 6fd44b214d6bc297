# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One trial: an element as chance makes it, every level read and every step up tried once.

Each level is tried for itself: the wall is put where it rests in this element (by Newton's
method), read, and stepped up once. So one trial gives a sample of every step and of every read,
and a step that fails spoils no other.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Generator
from dataclasses import dataclass
from functools import lru_cache
from typing import TypeVar

from ...device import Calibration, MemoryElement
from ...device.errors import ProcedureFailed
from ...device.factory import factory_calibration
from ...device.procedures import cycle, probe
from ...device.settings import Settings, TimeSettings
from ...physics import Design, Scatter, StateError, scattered, walls
from ...physics.equilibrium import resting_wall

T = TypeVar('T')

TICK = 100.0
"""A long tick: procedures wait by ticks, and the material is the same."""


@dataclass(frozen=True)
class Trial:
    """What one element did.

    Attributes:
        pinned: For every level, whether the defect pins a wall at all.
        read: For every level, whether the wall that rests there is read as that level.
        stepped: For every level but the last, whether one strain cycle takes the wall from it
            to the next: one wall, next to that defect, and read as that level.
    """

    pinned: tuple[bool, ...]
    read: tuple[bool, ...]
    stepped: tuple[bool, ...]


@lru_cache(maxsize=8)
def calibration_of(design: Design, settings: Settings) -> Calibration:
    """Return the factory calibration, that of the ideal element: no element has its own."""
    return factory_calibration(design, settings)


def studied(settings: Settings) -> Settings:
    """Return the settings with the long tick."""
    return dataclasses.replace(settings, time=TimeSettings(tick=TICK))


def try_element(
    design: Design, settings: Settings, scatter: Scatter, seed: int, end: str = 'left'
) -> Trial:
    """Make an element by chance and try it.

    Args:
        design: What was meant to be made.
        settings: The instrument's.
        scatter: Standard deviations of what chance decides.
        seed: Of the element: the same gives the same trial.
        end: The end that is probed.
    """
    settings = studied(settings)
    specimen = scattered(design, scatter, seed)
    element = MemoryElement(design, settings, calibration_of(design, settings))
    element.chain.become(specimen)
    pinned, read, stepped = [], [], []
    for level in range(design.levels):
        try:
            wall = resting_wall(specimen, level)
        except StateError:
            pinned.append(False)
            read.append(False)
            stepped.append(False)
            continue
        pinned.append(True)
        element.chain.place(wall)
        element.transducer.settle()
        read.append(_reads(element, level, end))
        if level + 1 < design.levels:
            compress = design.freed_by_compression(level)
            peak = settings.write.compression if compress else settings.write.tension
            carry_out(element, cycle(element, peak, settings.write))
            stepped.append(_stands(element, level + 1) and _reads(element, level + 1, end))
    return Trial(tuple(pinned), tuple(read), tuple(stepped[: design.levels - 1]))


def carry_out(element: MemoryElement, steps: Generator[None, None, T]) -> T:
    """Advance an element through a procedure and return what it gives."""
    while True:
        try:
            next(steps)
        except StopIteration as stop:
            result: T = stop.value
            return result
        element.advance()


def _stands(element: MemoryElement, level: int) -> bool:
    """Return whether one wall stands, and nearer to the level's defect than to any other."""
    design = element.design
    found = walls(design, element.chain.configuration)
    return len(found) == 1 and abs(found[0].position - design.defect(level)) < design.J / 2


def _reads(element: MemoryElement, level: int, end: str) -> bool:
    try:
        return carry_out(element, probe(element, end)).level == level
    except ProcedureFailed:  # it does not come to rest
        return False
