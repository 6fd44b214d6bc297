# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Calibration by delays: take the wall through all levels, measure, and bisect speeds of kicks."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from ..errors import ProcedureFailed, SettingsError
from ..instrument.blocks import Procedure
from ..instrument.end import End
from .calibration import Calibration, DelayTable, PulseCorrection
from .decoding import Decoder
from .listening import wait_until_pinned
from .reader import Writer
from .reading import BLANK, UNDECODABLE, Reading, describe_level

if TYPE_CHECKING:
    from ..memory import Memory

MIN_KICK_MARGIN = 0.7
"""Least level margin of a wall that a kick took to its level; one that stopped on its way has at
most 0.6."""


def measure_delays(element: Memory, writer: Writer) -> Procedure[Calibration]:
    """Erase, take the wall through all levels, and return the new calibration."""
    element.calibration = element.forecast or element.calibration
    empty = (yield from writer.erase(element)).reading
    blank = empty.delay if empty else None
    element.correct_pulses(element.pulse_corrections)
    levels: list[Reading] = []
    try:
        for level in range(element.design.levels):
            levels.append((yield from _reach_level(element, writer, level)))
        left, right = (
            DelayTable(
                tuple(each.get_delay(end) or 0.0 for each in levels),
                blank if end is End.RIGHT else None,
                tuple(each.shapes[end] for each in levels),
            )
            for end in End
        )
        measured = replace(element.calibration, left=left, right=right)
        measured.check(element.design.levels, element.settings.read.primary_end)
    except (ProcedureFailed, SettingsError) as error:
        raise ProcedureFailed(f'the calibration was not taken: {error}') from error
    return measured


def _correct_kick(element: Memory, level: int, speed: float) -> None:
    """Set the factor on the speed of the kick to a level; 0: no kick."""
    corrections = element.pulse_corrections
    corrections[level] = PulseCorrection(speed=speed)
    element.correct_pulses(corrections)


def _reach_level(element: Memory, writer: Writer, level: int) -> Procedure[Reading]:
    """Take the wall up to a level from the one below, and listen.

    A level that no kick reaches is reached by a step, if there is an actuator.
    """
    below = level - 1 if level else BLANK
    if element.pulse_corrections[level].speed and element.settings.is_kicked(level):
        reading = yield from _bisect_kick(element, writer, level)
        if reading is not None:
            return reading
        _correct_kick(element, level, 0.0)
        yield from writer.erase(element)
        yield from writer.go_to_level(element, BLANK, below)
        yield from wait_until_pinned(element)
    yield from writer.go_to_level(element, below, level, plainly=True)
    reading = yield from element.reader.read(element)
    margin, reason = _level_margin(element, level, reading)
    least = element.settings.write.min_margin
    if margin < least:
        reason = reason or f'the step to level {level} has a margin of {margin:.2f}, below {least}'
        raise ProcedureFailed(reason)
    return reading


def _bisect_kick(element: Memory, writer: Writer, level: int) -> Procedure[Reading | None]:
    """Kick the wall to a level, at other speeds if it misses; return None if a step must do.

    After a miss the wall continues from where it is, or from a blank element.
    """
    settings, place = element.settings, level - 1 if level else BLANK
    search = KickSearch(element.pulse_corrections[level].speed, settings.write.kick_tries)
    while True:
        if not BLANK <= place < level:
            yield from writer.erase(element)
            place = BLANK
        yield from writer.go_to_level(element, place, level)
        yield from wait_until_pinned(element)
        reading = yield from element.reader.read(element)
        margin, reason = _level_margin(element, level, reading)
        if search.has_arrived(margin):
            return reading
        if not search.change_speed(margin, _find_side(element, level, reading)):
            break
        _correct_kick(element, level, search.speed)
        near = reading.level if reading.level_margin >= MIN_KICK_MARGIN else UNDECODABLE
        place = near if near < level else UNDECODABLE
    if level and settings.actuator.present:
        return None
    raise ProcedureFailed(reason or f'no kick takes the wall to level {level} again')


class KickSearch:
    """A search for the speed of a kick: slower if the wall went too far, faster if it fell short.

    A low margin means that the wall stopped on its way. If no speed takes it to the level, the one
    that takes it nearest is used.
    """

    def __init__(self, speed: float, tries: int) -> None:
        """Start with a factor on the speed in the settings."""
        self.speed = speed
        self._tries = tries - 1
        self._best = -math.inf, speed
        self._enough = MIN_KICK_MARGIN
        self._short, self._far, self._faster = 0.0, math.inf, True

    def has_arrived(self, margin: float) -> bool:
        """Return whether the wall has arrived, according to its level margin."""
        return margin >= self._enough

    def change_speed(self, margin: float, side: int) -> bool:
        """Select another speed, after the last one the best; return whether there is one.

        Args:
            margin: Level margin after the last kick.
            side: 1 if the wall went beyond its level, -1 if it fell short, 0 if it is there.
        """
        self._best = max(self._best, (margin, self.speed), key=lambda each: each[0])
        if side > 0:
            self._far = min(self._far, self.speed)
        elif side < 0:
            self._short = max(self._short, self.speed)
        other = self._propose_speed(side)
        closed = self._far < 1.004 * self._short  # nothing between is worth a try
        if self._tries <= 0 or closed or not 0.1 <= other <= 10.0:
            return self._return_to_best()
        self._tries -= 1
        self.speed = other
        return True

    def _propose_speed(self, side: int) -> float:
        """Halve the interval in which the speed must lie, or step by a tenth towards it."""
        if self._short and self._far < math.inf:
            return math.sqrt(self._short * self._far)
        step = 1.1
        other = self.speed * step ** -((1 if self._faster else -1) * (side or 1))
        if self._faster and not 1.0 / 1.8 < other < 1.8:
            # The fastest kicks fall short again: the speed may lie on the other side.
            self._short, self._far, self._faster = 0.0, math.inf, False
            return step if other < 1.0 else 1.0 / step
        return other

    def _return_to_best(self) -> bool:
        """Select the best speed once more; return whether it is worth that."""
        margin, self.speed = self._best
        hopeless = margin == -math.inf or self._enough < MIN_KICK_MARGIN
        self._enough = margin - 0.1  # level margins of a wall at the same place differ by less
        return not hopeless


def _find_side(element: Memory, level: int, reading: Reading) -> int:
    """Return whether a wall is detected beyond a level, 1, short of it, -1, or neither, 0."""
    if element.phase(End.LEFT) == 0:
        return -1  # it fell back
    if element.phase(End.RIGHT) == 1:
        return 1  # it ran out
    for end in End:
        if (delay := reading.get_delay(end)) is not None:
            late = delay - element.calibration.table(end).delays[level]
            return int(math.copysign(1.0, late if end is End.LEFT else -late))
    return 0


def _level_margin(element: Memory, level: int, reading: Reading) -> tuple[float, str]:
    """Return the margin with which the end that names levels detects one, or why an end does not.

    The reading itself does not say, because the calibration may be off while it is measured.
    """
    decoder = Decoder(element.design, element.settings.read, element.calibration)
    margin = 1.0
    for end in End:
        if (delay := reading.get_delay(end)) is None:
            return -math.inf, f'level {level} gives no echo at the {end} end'
        nearest, clear = element.calibration.table(end).find_nearest(delay)
        if end is element.settings.read.primary_end:
            margin, right = clear, nearest == level
        else:
            low, high, _ = reading.shapes[end]
            # The wall still swings: the other end distinguishes two that are alike here.
            probe = element.transducer.probes[end]
            agreed, _ = decoder.measure_agreement(probe, end, level, (low, delay, high))
            # least margin at the end that does not name levels: far from it, delays of an
            # element that is not yet calibrated differ most
            right = agreed >= 0.2
        if not right:
            found = f'{describe_level(nearest)}, at {delay:.2f}'
            return -math.inf, f'on the way to level {level} the {end} end hears {found}'
    return margin, ''
