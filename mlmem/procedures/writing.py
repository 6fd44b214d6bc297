# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Writing: drive the wall to a level by the fastest moves, verify, and try again; or climb: take
it up step by step with learnt pulses, or at once by a kick, listen, and learn.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from ..errors import NotFollowed, ProcedureFailed
from ..instrument.end import End
from ..memory import Memory
from ..moves.corrections import UNKICKED, PulseCorrection, kicked, learnt, menu, without_kicks
from ..readers.decoding import agreement, primary
from ..readers.reading import BLANK, UNDECODABLE, Reading, describe_level
from ..settings import Settings
from . import estimates
from .blocks import Procedure, Result, return_to_zero
from .driving import erase, go_to_level
from .listening import listen, look, stand_still

NUDGE = 1.06
"""Factor on the speed of a kick after one that fell short: about a quarter of the way to the next
level."""


def write(element: Memory, level: int) -> Procedure[Result]:
    """Write a level: step up to it, down to it, or erase and start again; verify by reading.

    A further attempt continues from the level that was read, with peak strains `write.escalation`
    times greater, because a wall that did not follow was not pulled hard enough. A wall that
    stopped on its way also reads as the nearest level, but later steps would fail: with a margin
    below `write.min_margin` it is written again. The last attempt uses only steps up and a kink.
    A kick that went too far is made slower, one that fell short faster. With `write.method` auto
    an actuator that does not follow is left alone: kicks go on.
    An element that has learnt its pulses is taken up step by step instead, and goes on learning.
    Where both ends hear something and do not agree, it listens once more before that.

    Raises:
        ProcedureFailed: The level was not reached within `write.attempts`.
    """
    attempts, least = element.settings.write.attempts, element.settings.write.min_margin
    yield from return_to_zero(element)
    reading = element.reading
    if reading is None or reading.level == UNDECODABLE:
        reading = yield from listen(element)
    learnt = element.calibration.pulse_corrections is not None
    present, seen, nudge = reading.level, [], 1.0
    method = element.settings.write.method
    strained = element.settings.actuator.present
    for attempt in range(1, attempts + 1):
        element.progress.tried('write', attempt)
        estimates.expect(element, estimates.writing(element, present, level))
        try:
            if element.register is not None:
                from .many_walls import put  # few elements hold many walls

                yield from put(element, element.register, present, level)
            elif learnt and attempt > 1:
                yield from climb(element, present, level)
            else:
                plainly = strained and method != 'kick' and 1 < attempt == attempts
                force = _force(element, attempt)
                try:
                    yield from go_to_level(
                        element, present, level, force,
                        nudge=nudge, plainly=plainly, strained=strained,
                    )  # fmt: skip
                except NotFollowed:
                    if method != 'auto' or not strained:
                        raise
                    strained = False  # from here on by kicks
                    yield from return_to_zero(element)
            reading = yield from look(element)
            if _swings(element, reading):  # a wall that has just arrived, and its echoes with it
                reading = yield from look(element)
        except ProcedureFailed as failure:
            raise ProcedureFailed(str(failure), attempt) from failure
        present, said = reading.level, element.describe_content(reading.level)
        if present >= 0 and reading.level_margin < least:
            present, said = UNDECODABLE, f'{said} with a margin of {reading.level_margin:.2f}'
        if reading.level >= 0 and reading.level != level:  # a kick went too far, or fell short
            nudge *= NUDGE if reading.level < level else 1.0 / NUDGE
        if present == level:
            return Result(reading, attempt)
        seen.append(said)
    raise ProcedureFailed(
        f'{element.describe_content(level)} was not reached in {attempts} attempts; read instead: '
        f'{", ".join(seen)}',
        attempts,
    )


def restore(element: Memory, content: Reading) -> Procedure[Result]:
    """Restore a reading: write its level, or erase if it was blank.

    Raises:
        ProcedureFailed: It cannot be restored.
    """
    if content.level >= 0:
        return (yield from write(element, content.level))
    return (yield from erase(element))


def _swings(element: Memory, reading: Reading) -> bool:
    """Whether another look may tell more: both ends hear an echo, but not of the same wall; or
    waveforms tell no content, while waves of the last move are dying away.
    """
    delays = reading.left_delay, reading.right_delay
    return reading.level == UNDECODABLE and (element.waveforms is not None or None not in delays)


def _force(element: Memory, attempt: int) -> float:
    """Return the factor on the peak strains of an attempt, counted from 1."""
    settings = element.settings.write
    return float(min(settings.escalation ** (attempt - 1), settings.escalation_limit))


# --- climbing -----------------------------------------------------------------------------------

NOWHERE = -math.inf
"""Margin of a level that is not heard."""

CLEAR = 0.7
"""Least level margin of a wall that has arrived; one stopped on its way has at most 0.6."""

CONFIRMED = 0.2
"""Least margin at the end that does not name levels: far from it, delays of an element that is not
yet known differ most."""

STRIDE = 1.1
"""Factor on the speed of a kick until one went too far and one fell short."""

ASTRAY = 1.8
"""Most by which a speed is changed before the other side is tried."""

CLOSED = 1.004
"""Ratio of two speeds between which there is no other worth a try."""

BESIDE = 0.1
"""Level margins of a wall at the same place differ by less."""


def climb(element: Memory, place: int, level: int) -> Procedure[dict[int, Reading]]:
    """Take the wall from a place up to a level, and learn which pulses do that.

    The place is a level, `BLANK` or `UNDECODABLE`. After a failed step the wall continues from
    where it is, or from a blank element; the step is repeated with another pulse. A kick skips the
    levels on the way, and is heard when the wall stands still. A level that no kick reaches is
    reached by a step, if there is an actuator. What is learnt is kept in the calibration.

    Returns:
        The readings of the levels on the way.

    Raises:
        ProcedureFailed: No pulse takes the wall up to some level.
    """
    settings = element.settings
    lessons = [
        _lesson(settings, level, correction)
        for level, correction in enumerate(element.calibration.pulses(settings))
    ]
    heard: dict[int, Reading] = {}
    while place != level:
        kicks = [at for at in range(level + 1) if isinstance(lessons[at], _Bisection)]
        if not BLANK <= place < level:
            yield from erase(element)
            place = BLANK
        corrections, aim = [lesson.correction for lesson in lessons], max([place + 1, *kicks])
        by_kick = aim in kicks
        yield from go_to_level(element, place, aim, plainly=not by_kick, corrections=corrections)
        if by_kick:
            yield from stand_still(element)
        heard[aim] = yield from look(element)
        margin, why = _margin(element, aim, heard[aim])
        if lessons[aim].passed(margin):
            place = aim
        elif lessons[aim].another(margin, _beyond(element, aim, heard[aim])):
            here = _place(heard[aim])
            place = here if here < aim else UNDECODABLE  # beyond, a level would be skipped
        elif by_kick and aim and settings.actuator.present:
            lessons[aim], place = _lesson(settings, aim, UNKICKED), UNDECODABLE
        else:
            raise ProcedureFailed(why or f'no pulse takes the wall to level {aim} again')
    found = learnt((lesson.correction for lesson in lessons), settings)
    element.calibration = replace(element.calibration, pulse_corrections=found)
    return heard


class _Lesson:
    """Learning the pulse for one level.

    A low margin means that the wall stopped on its way. If no pulse takes it to the level, the one
    that takes it nearest is used.
    """

    def __init__(self, correction: PulseCorrection, others: Sequence[PulseCorrection]) -> None:
        """Start with the known pulse, then try others."""
        self.correction = correction
        self._menu = [other for other in others if other != correction]
        self._best = NOWHERE, correction
        self._enough = CLEAR if self._menu else NOWHERE

    def passed(self, margin: float) -> bool:
        """Return whether the wall has arrived, according to a level margin."""
        return margin > NOWHERE and margin >= self._enough

    def another(self, margin: float, beyond: int) -> bool:
        """Select another pulse, after the last one the best; return whether there is one.

        `beyond` says where the wall is heard: 1 beyond its level, -1 short of it, 0 at it.
        """
        self._best = max(self._best, (margin, self.correction), key=lambda each: each[0])
        if self._menu:
            self.correction = self._menu.pop(0)
            return True
        best, self.correction = self._best
        hopeless = best == NOWHERE or self._enough < CLEAR
        self._enough = best - BESIDE
        return not hopeless


class _Bisection(_Lesson):
    """Learning the speed of a kick: slower if the wall went too far, faster if it fell short."""

    def __init__(self, correction: PulseCorrection, tries: int) -> None:
        """Start with the known speed."""
        super().__init__(correction, ())
        self._enough, self._tries = CLEAR, tries - 1
        self._short, self._far, self._way = 0.0, math.inf, 1

    def another(self, margin: float, beyond: int) -> bool:
        """Halve the interval in which the speed must lie, or step towards it."""
        speed = self.correction.speed
        if beyond > 0:
            self._far = min(self._far, speed)
        elif beyond < 0:
            self._short = max(self._short, speed)
        if self._short and self._far < math.inf:
            wanted = math.sqrt(self._short * self._far)
        else:
            wanted = speed * STRIDE ** -(self._way * (beyond or 1))
            if self._way > 0 and not 1.0 / ASTRAY < wanted < ASTRAY:
                # The fastest kicks fall short again: the speed may lie on the other side.
                self._short, self._far, self._way = 0.0, math.inf, -1
                wanted = STRIDE if wanted < 1.0 else 1.0 / STRIDE
        closed = self._far < CLOSED * self._short
        if self._tries <= 0 or closed or not 0.1 <= wanted <= 10.0:
            return super().another(margin, beyond)
        self._best = max(self._best, (margin, self.correction), key=lambda each: each[0])
        self._tries -= 1
        self.correction = PulseCorrection(speed=wanted)
        return True


def _lesson(settings: Settings, level: int, correction: PulseCorrection) -> _Lesson:
    """Return the lesson for a level: of a kick, unless it is known that none reaches it."""
    if correction.speed and kicked(settings, level):
        return _Bisection(correction, settings.write.pulses)
    if not correction.speed:
        settings = without_kicks(settings, (level,))
    others = [
        replace(each, speed=correction.speed and each.speed) for each in menu(settings, level)
    ]
    return _Lesson(correction, others[: settings.write.pulses])


def _beyond(element: Memory, level: int, reading: Reading) -> int:
    """Return whether a wall is heard beyond a level, 1, short of it, -1, or neither, 0."""
    if element.phase(End.LEFT) == 0:
        return -1  # it fell back
    if element.phase(End.RIGHT) == 1:
        return 1  # it ran out
    for end in element.calibration.ends:
        delay = reading.left_delay if end is End.LEFT else reading.right_delay
        if delay is not None:
            late = delay - element.calibration.table(end).delays[level]
            return int(math.copysign(1.0, late if end is End.LEFT else -late))
    return 0


def _place(reading: Reading) -> int:
    """Return the level at which the wall is clearly heard, or `UNDECODABLE`."""
    return reading.level if reading.level_margin >= CLEAR else UNDECODABLE


def _margin(element: Memory, level: int, reading: Reading) -> tuple[float, str]:
    """Return the margin with which the end that names levels hears one, or why an end does not.

    The reading itself does not say, because the calibration may be off while it is learnt.
    """
    calibration, margin = element.calibration, 1.0
    for end in calibration.ends:
        delay = reading.left_delay if end is End.LEFT else reading.right_delay
        if delay is None:
            return NOWHERE, f'level {level} gives no echo at the {end} end'
        nearest, clear = calibration.table(end).nearest(delay)
        if end is primary(element.settings.read) or len(calibration.ends) == 1:
            margin, right = clear, nearest == level
        else:
            probe = element.transducer.probes[end]
            shape = reading.shapes[end]
            # The wall still swings: the other end says which of two that sound alike here.
            agreed, _ = agreement(element.design, calibration, probe, end, level, delay, shape)
            right = agreed >= CONFIRMED
        if not right:
            said = f'{describe_level(nearest)}, at {delay:.2f}'
            return NOWHERE, f'on the way to level {level} the {end} end hears {said}'
    return margin, ''
