# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Expected durations of procedures in time units, for display only.

Anything unexpected (a failed attempt, an end that does not come to rest) is added as it occurs.
"""

from __future__ import annotations

from itertools import pairwise

from ..errors import Refused
from ..memory import Memory
from ..moves.kick import kick_duration
from ..moves.move import blank_content
from ..moves.planner import find_route
from ..readers.listening import expected_wait
from ..readers.reading import BLANK, UNDECODABLE
from ..rejections import ErrorCode

RECORD_TIME = 900.0
"""Time for which both ends are recorded after a pulse."""

QUIET_DAMPING_TIMES = 10.0
"""Damping times 1 / eta for which the element rests before a pulse: what is left of waves is then
fainter than the noise of a good transducer."""

SURVEY_SHOTS = 13
"""Shots of a survey."""


def expect_duration(element: Memory, duration: float) -> None:
    """Expect the running procedure to end after at least this time."""
    element.progress.expect_end(element.ticks + duration / element.tick)


def estimate_read(element: Memory) -> float:
    """Return how long a read of an element at rest takes."""
    return element.reader.read_duration(element)


def driving_time(element: Memory, present: int, target: int) -> float:
    """Return the time from a level, `BLANK` or `UNDECODABLE` to another, until it is at rest."""
    settings = element.calibration.remove_missed_kicks(element.settings)
    if settings.holds_words:
        blank = blank_content(settings)
        present, target = (blank if content == BLANK else content for content in (present, target))
    elif present == UNDECODABLE:
        present = element.design.levels - 1
        if target != BLANK:
            return driving_time(element, present, BLANK) + driving_time(element, BLANK, target)
    moves = find_route(element.design, settings, present, target)
    ringing = moves[-1].ringing if moves else 0.0
    return sum(move.duration for move in moves) + settings.write.final_settle + ringing


def writing_time(element: Memory, present: int, target: int) -> float:
    """Return the time to drive the wall to a level, and to verify it."""
    return max(driving_time(element, present, target), expected_wait(element)) + estimate_read(
        element
    )


def estimate_all_levels(element: Memory) -> float:
    """Return the time of a calibration or self-test.

    That is to erase, write and read every level, and restore the content.
    """
    levels = (BLANK, *element.reader.single_walls.values())
    top = levels[-1]
    steps = sum(driving_time(element, *pair) for pair in pairwise(levels))
    content = max(BLANK, find_content(element))
    restoring = writing_time(element, top, content)
    return (
        writing_time(element, top, BLANK)
        + steps
        + (len(levels) - 1) * estimate_read(element)
        + restoring
    )


def estimate_survey(element: Memory) -> float:
    """Return the time of a survey."""
    content = max(BLANK, find_content(element))
    top = max(element.reader.single_walls.values(), default=BLANK)
    each = RECORD_TIME + (QUIET_DAMPING_TIMES / element.design.eta if element.design.eta else 0.0)
    way = driving_time(element, content, BLANK) + driving_time(element, BLANK, top)
    return way + writing_time(element, top, content) + SURVEY_SHOTS * each


def find_content(element: Memory) -> int:
    """Return the content, as far as known: a level, `BLANK` or `UNDECODABLE`."""
    return UNDECODABLE if element.reading is None else element.reading.level


# --- of procedures, when they begin -----------------------------------------------------------


def estimate_write(element: Memory, level: int) -> float:
    """Return the time of a write; what is not known is read first."""
    if (present := find_content(element)) == UNDECODABLE:
        return 2.0 * estimate_read(element) + driving_time(element, BLANK, level)
    return writing_time(element, present, level)


def estimate_erase(element: Memory) -> float:
    """Return the time of an erase."""
    return writing_time(element, find_content(element), BLANK)


def estimate_kick(element: Memory, speed: float) -> float:
    """Return the time of a kick by hand.

    Raises:
        Refused: The transducer cannot move the end from one phase to the other.
    """
    design, settings = element.design, element.settings
    stroke, longest = abs(design.D_s2 - design.D_s1), settings.transducer.max_stroke
    if stroke > longest:
        raise Refused.of_value(
            ErrorCode.UNSUPPORTED,
            'transducer.max_stroke',
            longest,
            f'at least {stroke:.3g}, the stroke of a kick',
        )
    return kick_duration(design, settings.kick, speed, settings.kick.settle)


def estimate_abort(element: Memory) -> float:
    """Return the time of an abort."""
    return element.settings.erase.release if element.actuator.strain else 0.0
