# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How long procedures are expected to take, in time units: for who watches them, and no more.

What is not foreseen (a try in vain, an end that is long restless) is expected when it comes.
"""

from __future__ import annotations

from ..echo import TAIL
from ..memory import Memory
from ..moves import How, ringing, route
from ..reading import BLANK, UNDECODABLE

HASTY = (How.STROKE, How.THROW)
"""Moves after which the element rings before it can be read."""


def expect(element: Memory, duration: float) -> None:
    """Expect the running procedure to end in a time from now, or later."""
    element.progress.expect(element.ticks + duration / element.tick)


def reading(element: Memory, pulses: int = 1) -> float:
    """Return how long an element at rest is listened to."""
    longest = max(element.calibration.longest(end) for end in element.calibration.ends)
    return pulses * (element.settings.read.rest + longest + TAIL)


def driving(element: Memory, present: int, target: int) -> float:
    """Return how long it takes from a place, `BLANK` or `UNDECODABLE`, to another, and to rest."""
    start = element.design.levels - 1 if present == UNDECODABLE else present
    moves = route(element.design, element.settings, start, target)
    if present == UNDECODABLE and target != BLANK:
        return driving(element, start, BLANK) + driving(element, BLANK, target)
    rings = ringing(element.design) if moves and moves[-1].how in HASTY else 0.0
    return sum(move.time for move in moves) + element.settings.write.final_settle + rings


def writing(element: Memory, present: int, target: int) -> float:
    """Return how long it takes to drive the wall somewhere, and to see that it is there."""
    return driving(element, present, target) + reading(element)


def everything(element: Memory) -> float:
    """Return how long it takes to erase, to write and hear every level, and to restore what was.

    As calibration and self-test do.
    """
    top, pulses = element.design.levels - 1, len(element.calibration.ends)
    steps = sum(driving(element, level - 1, level) for level in range(top + 1))
    content = max(BLANK, known(element))
    restoring = writing(element, top, content)
    return writing(element, top, BLANK) + steps + (top + 1) * reading(element, pulses) + restoring


def known(element: Memory) -> int:
    """Return the content as far as it is known: a level, `BLANK` or `UNDECODABLE`."""
    return UNDECODABLE if element.reading is None else element.reading.level
