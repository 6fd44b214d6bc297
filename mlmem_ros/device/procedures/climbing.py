# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Climbing: take the wall up step by step with learnt pulses, and listen at each step."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from ..end import End
from ..errors import ProcedureFailed
from ..memory import Memory
from ..reading import BLANK, UNDECODABLE, Reading, describe_level
from ..trims import Trim, learnt, menu
from .blocks import Procedure
from .driving import drive
from .erasing import erase
from .listening import probe

Heard = dict[End, Reading]
"""The reading at each end that is read from."""

NOWHERE = -math.inf
"""Margin of a level that is not heard."""

CLEAR = 0.7
"""Least level margin of a wall that has arrived; one stopped on its way has at most 0.6."""

BESIDE = 0.1
"""Level margins of a wall at the same place differ by less."""


def climb(element: Memory, place: int, level: int) -> Procedure[dict[int, Heard]]:
    """Take the wall from a place up to a level, and learn which pulses do that.

    The place is a level, `BLANK` or `UNDECODABLE`. After a failed step the wall continues from
    where it is, or from a blank element; the step is repeated with another pulse. What is learnt
    is kept in the calibration.

    Returns:
        The readings of the levels on the way, by end.

    Raises:
        ProcedureFailed: No pulse takes the wall up to some level.
    """
    settings = element.settings
    lessons = [
        _Lesson(trim, menu(settings, level)[: settings.write.pulses])
        for level, trim in enumerate(element.calibration.pulses(settings))
    ]
    heard: dict[int, Heard] = {}
    while place != level:
        if not BLANK <= place < level:
            yield from erase(element)
            place = BLANK
        trims = [lesson.trim for lesson in lessons]
        yield from drive(element, place, place + 1, plainly=True, trims=trims)
        heard[place + 1] = yield from _hear(element)
        margin, why = _margin(element, place + 1, heard[place + 1])
        if lessons[place + 1].passed(margin):
            place += 1
        elif lessons[place + 1].another(margin):
            here = _place(heard[place + 1])
            place = here if here <= place else UNDECODABLE  # beyond, a level would be skipped
        else:
            raise ProcedureFailed(why or f'no pulse takes the wall to level {place + 1} again')
    found = learnt((lesson.trim for lesson in lessons), settings)
    element.calibration = replace(element.calibration, trims=found)
    return heard


class _Lesson:
    """Learning the pulse for one level.

    A low margin means that the wall stopped on its way. If no pulse takes it to the level, the one
    that takes it nearest is used.

    Attributes:
        trim: The current pulse.
    """

    def __init__(self, trim: Trim, others: Sequence[Trim]) -> None:
        """Start with the known pulse, then try others."""
        self.trim = trim
        self._menu = [other for other in others if other != trim]
        self._best = NOWHERE, trim
        self._enough = CLEAR if self._menu else NOWHERE

    def passed(self, margin: float) -> bool:
        """Return whether the wall has arrived, according to a level margin."""
        return margin > NOWHERE and margin >= self._enough

    def another(self, margin: float) -> bool:
        """Select another pulse, after the last one the best; return whether there is one."""
        self._best = max(self._best, (margin, self.trim), key=lambda each: each[0])
        if self._menu:
            self.trim = self._menu.pop(0)
            return True
        best, self.trim = self._best
        hopeless = best == NOWHERE or self._enough < CLEAR
        self._enough = best - BESIDE
        return not hopeless


def _hear(element: Memory) -> Procedure[Heard]:
    heard = {}
    for end in element.calibration.ends:
        heard[end] = yield from probe(element, end)
    return heard


def _place(heard: Heard) -> int:
    """Return the level at which all ends clearly hear the wall, or `UNDECODABLE`."""
    said = {each.level if each.level_margin >= CLEAR else UNDECODABLE for each in heard.values()}
    return said.pop() if len(said) == 1 else UNDECODABLE


def _margin(element: Memory, level: int, heard: Heard) -> tuple[float, str]:
    """Return the least margin with which the ends hear a level, or why one does not."""
    margins = []
    for end, reading in heard.items():
        if reading.delay is None:
            return NOWHERE, f'level {level} gives no echo at the {end} end'
        nearest, margin = element.calibration.table(end).nearest(reading.delay)
        if nearest != level:
            said = f'{describe_level(nearest)}, at {reading.delay:.2f}'
            return NOWHERE, f'on the way to level {level} the {end} end hears {said}'
        margins.append(margin)
    return min(margins), ''
