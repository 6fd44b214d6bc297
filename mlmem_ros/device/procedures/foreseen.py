# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Expected durations of procedures, in time units: only for display.

Anything unforeseen (a failed attempt, an end that stays restless) is added when it occurs.
"""

from __future__ import annotations

from ..echo import TAIL
from ..memory import Memory
from ..moves import How, ringing, route
from ..reading import BLANK, UNDECODABLE

HASTY = (How.STROKE, How.THROW)
"""Moves after which the element rings and cannot be read yet."""


def expect(element: Memory, duration: float) -> None:
    """Expect the running procedure to end after this time, or later."""
    element.progress.expect(element.ticks + duration / element.tick)


def reading(element: Memory, pulses: int = 1) -> float:
    """Return how long an element at rest is listened to."""
    longest = max(element.calibration.longest(end) for end in element.calibration.ends)
    return pulses * (element.settings.read.rest + longest + TAIL)


def driving(element: Memory, present: int, target: int) -> float:
    """Return how long it takes from one place, or `BLANK` or `UNDECODABLE`, to another at rest."""
    start = element.design.levels - 1 if present == UNDECODABLE else present
    moves = route(element.design, element.settings, start, target)
    if present == UNDECODABLE and target != BLANK:
        return driving(element, start, BLANK) + driving(element, BLANK, target)
    rings = ringing(element.design) if moves and moves[-1].how in HASTY else 0.0
    return sum(move.time for move in moves) + element.settings.write.final_settle + rings


def writing(element: Memory, present: int, target: int) -> float:
    """Return how long it takes to drive the wall somewhere, and to verify it."""
    return driving(element, present, target) + reading(element)


def everything(element: Memory) -> float:
    """Return how long it takes to erase, write and hear every level, and restore the content.

    As calibration and self-test do.
    """
    top, pulses = element.design.levels - 1, len(element.calibration.ends)
    steps = sum(driving(element, level - 1, level) for level in range(top + 1))
    content = max(BLANK, known(element))
    restoring = writing(element, top, content)
    return writing(element, top, BLANK) + steps + (top + 1) * reading(element, pulses) + restoring


def known(element: Memory) -> int:
    """Return the content, as far as known: a level, `BLANK` or `UNDECODABLE`."""
    return UNDECODABLE if element.reading is None else element.reading.level
