# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Expected durations of procedures in time units, for display only.

Anything unexpected (a failed attempt, an end that does not come to rest) is added as it occurs.
"""

from __future__ import annotations

from ..echo import TAIL
from ..memory import Memory
from ..moves import How, ringing, route
from ..reading import BLANK, UNDECODABLE

HASTY = (How.STROKE, How.THROW)
"""Moves after which the element rings and cannot be read yet."""


def expect(element: Memory, duration: float) -> None:
    """Expect the running procedure to end after at least this time."""
    element.progress.expect(element.ticks + duration / element.tick)


def reading(element: Memory, pulses: int = 1) -> float:
    """Return how long probes of an element at rest take."""
    longest = max(element.calibration.longest(end) for end in element.calibration.ends)
    return pulses * (element.settings.read.rest + longest + TAIL)


def driving(element: Memory, present: int, target: int) -> float:
    """Return the time from a level, `BLANK` or `UNDECODABLE` to another, until it is at rest."""
    start = element.design.levels - 1 if present == UNDECODABLE else present
    moves = route(element.design, element.settings, start, target)
    if present == UNDECODABLE and target != BLANK:
        return driving(element, start, BLANK) + driving(element, BLANK, target)
    rings = ringing(element.design) if moves and moves[-1].how in HASTY else 0.0
    return sum(move.time for move in moves) + element.settings.write.final_settle + rings


def writing(element: Memory, present: int, target: int) -> float:
    """Return the time to drive the wall to a level, and to verify it."""
    return driving(element, present, target) + reading(element)


def everything(element: Memory) -> float:
    """Return the time of a calibration or self-test.

    That is to erase, write and read every level, and restore the content.
    """
    top, pulses = element.design.levels - 1, len(element.calibration.ends)
    steps = sum(driving(element, level - 1, level) for level in range(top + 1))
    content = max(BLANK, known(element))
    restoring = writing(element, top, content)
    return writing(element, top, BLANK) + steps + (top + 1) * reading(element, pulses) + restoring


def known(element: Memory) -> int:
    """Return the content, as far as known: a level, `BLANK` or `UNDECODABLE`."""
    return UNDECODABLE if element.reading is None else element.reading.level
