# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What was decoded: a level with its margins, or blank, or undecodable and why."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, field
from typing import TYPE_CHECKING

from ..errors import OutcomeCode
from ..instrument.echo import Shape
from ..instrument.end import End
from ..procedure_table import BLANK as BLANK
from ..procedure_table import UNDECODABLE as UNDECODABLE
from ..procedure_table import describe_level as describe_level
from ..schema import describe_field

if TYPE_CHECKING:
    from ..memory import Memory

WELL_ERROR_CELLS = 0.25
"""Error from the well in which a wall rests, in cells: it shifts the echo of a wall between levels
by up to 0.4 cells from that of a level."""


@dataclass(frozen=True)
class Reading:
    """A decoded echo, or the echoes from both ends.

    Attributes:
        level: A level or word from 0, `BLANK` or `UNDECODABLE`.
        code: Binary code of a level; empty otherwise.
        end: The end whose delay is given: 'left', 'right' or 'both'.
        delay: Echo delay there in time units, or None without an echo; for both, at the left.
        level_margin: 1 at the calibrated delay, 0 half-way to the next level; the lesser of both
            ends.
        threshold_margin: Greatest v_c over the threshold; above 1 for an echo; the lesser of both
            ends.
        distance: Distance from the end to the wall in cells; infinite without an echo. For both
            ends, from the left.
        reason: Why it could not be decoded; empty otherwise.
        walls: Number of walls, as far as the ends show it: 0, 1, 2 or 3 (three or more); None if
            they cannot.
        right_delay: Echo delay at the right end if it was probed.
        left_delay: Echo delay at the left end if it was probed.
        shapes: Shapes of the echoes, by end.
    """

    level: int
    code: str
    end: str
    delay: float | None
    level_margin: float
    threshold_margin: float
    distance: float = describe_field(
        MISSING, 'from the end to the wall in cells; infinite without an echo', null=math.inf
    )
    reason: str = ''
    walls: int | None = None
    right_delay: float | None = None
    left_delay: float | None = None
    shapes: Mapping[End, Shape] = field(default_factory=dict, compare=False, repr=False)

    @property
    def content(self) -> int:
        """A level of one wall, or the word of a register; -1 if blank, -2 if not known."""
        return self.level

    def get_delay(self, end: End) -> float | None:
        """Return the echo delay at an end, or None without one."""
        return self.left_delay if end is End.LEFT else self.right_delay

    @property
    def confidence(self) -> float:
        """How much may be lost before the answer changes, from 0 to 1; 0 if nothing was decoded.

        The lesser of two fractions: how far the delay may still shift on the way to the next level
        (the level margin), and how much of its height the echo may still lose before it is missed
        (1 - 1 / threshold margin).
        """
        if self.level == UNDECODABLE or self.threshold_margin <= 1.0:
            return 0.0
        return max(0.0, min(self.level_margin, 1.0 - 1.0 / self.threshold_margin))


class Unclear(Exception):
    """What the ends did names no content.

    Attributes:
        walls: Number of walls, as far as the ends show it; None if they do not.
    """

    def __init__(self, reason: str, walls: int | None = None) -> None:
        super().__init__(reason)
        self.walls = walls


def find_failure_code(last: Reading | None) -> OutcomeCode:
    """Return the code of a procedure that failed, from its last reading."""
    is_undecodable = last is not None and last.level == UNDECODABLE
    return OutcomeCode.UNDECODABLE if is_undecodable else OutcomeCode.FAILED


@dataclass(frozen=True)
class Unknown:
    """The content is no longer known; also the event that says so."""

    reason: str = describe_field(MISSING, 'what may have moved the wall')
    since: int = describe_field(MISSING, 'the tick in which it took effect', low=0, high=2**62)

    def __str__(self) -> str:
        return f'unknown since tick {self.since}: {self.reason}'


def correct_speed(element: Memory, reading: Reading, level: int, attempt: int) -> float:
    """Return the factor on the speed of the next kick, as the last one went too far or fell short.

    It changes the speed by a quarter of the way to the next level at first, then by less.
    """
    change: float = 1.06 ** (1.0 / attempt)
    if went_too_far(element, reading, level):
        return 1.0 / change
    return change if 0 <= reading.level < level else 1.0


def went_too_far(element: Memory, reading: Reading, level: int) -> bool:
    """Return whether a kick took the wall past its level: to another, or out of the right end."""
    left = reading.level == UNDECODABLE and element.phase(End.RIGHT) != 0
    return left or reading.level > level
