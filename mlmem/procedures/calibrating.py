# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Calibration: measure the echo delay of every level, and bisect the speeds of kicks."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import singledispatch
from typing import Any

from ..commands import Outcome
from ..corrections import PulseCorrection, is_kicked, make_corrections
from ..errors import Astray, ProcedureFailed, SettingsError
from ..instrument.blocks import Procedure
from ..instrument.end import End
from ..memory import Memory
from ..moves.kick import kick_out
from ..moves.strain_cycle import return_to_zero
from ..readers.calibration import Calibration, DelayTable
from ..readers.decoding import measure_agreement, primary_end
from ..readers.delay_reader import DelayReader
from ..readers.listening import record_waveforms, wait_until_pinned
from ..readers.reader import Reader
from ..readers.reading import BLANK, UNDECODABLE, Reading, describe_level
from ..readers.record_reader import RecordReader
from ..readers.waveform_reader import WaveformReader
from .driving import erase, go_to_level, seems_blank
from .reading import take_settled_reading
from .writing import correct_speed, restore_content, went_too_far, write

MIN_KICK_MARGIN = 0.7
"""Least level margin of a wall that a kick took to its level; one that stopped on its way has at
most 0.6."""


def calibrate(element: Memory) -> Procedure[Outcome]:
    """Calibrate the reader of an element, and restore the content in any case but an abort.

    Raises:
        ProcedureFailed: As `calibrate_reader`, or the content could not be restored.
    """
    yield from return_to_zero(element)
    content = yield from take_settled_reading(element)
    try:
        found = yield from calibrate_reader(element.reader, element)
    except ProcedureFailed as failure:
        try:
            yield from restore_content(element, content)
        except ProcedureFailed as lost:
            raise ProcedureFailed(f'{failure}; nor was the content restored: {lost}') from failure
        raise
    return replace((yield from restore_content(element, content)), **found)


@contextmanager
def _keep_unless_measured(element: Memory) -> Iterator[None]:
    """Take the old calibration back if measuring ends early: by a failure, an abort or a fault."""
    known = element.calibration
    try:
        yield
    except BaseException:  # an abort closes the procedure
        element.calibration = known
        raise


@singledispatch
def calibrate_reader(reader: Reader, element: Memory) -> Procedure[dict[str, Any]]:
    """Write one wall to every level that can be used: each must be read as forecast.

    If kicks write every level, the factor on damping and friction of the design is found first,
    and then one on the speed of every kick, which makes up for it.

    Returns:
        Fields of the result.

    Raises:
        ProcedureFailed: A level was not reached.
    """
    levels = range(element.design.levels)
    found: dict[str, float] = {}
    kicked = all(is_kicked(element.settings, level) for level in levels)
    if kicked and len(levels) > 1 and not reader.holds_words:
        with _keep_unless_measured(element):
            found = yield from _find_factors(element, reader)
    for each in reader.single_walls.values():
        yield from write(element, each)
    return {'found': found}


def _find_factors(element: Memory, reader: Reader) -> Procedure[dict[str, float]]:
    """Find the factors on losses and on the speeds of kicks; return them by name.

    Raises:
        ProcedureFailed: As `_find_loss_factor` and `_find_kick_factors`.
    """
    found = {}
    if isinstance(reader, WaveformReader) and reader.made is not None:
        loss_factor = yield from _find_loss_factor(element, reader)
        element.calibration = replace(element.calibration, loss_factor=loss_factor)
        found['loss_factor'] = loss_factor
    return found | {'kick_factor': (yield from _find_kick_factors(element, reader))}


def _find_loss_factor(element: Memory, reader: WaveformReader) -> Procedure[float]:
    """Find the factor on damping and friction by the answer of the blank element.

    No reading tells that it is blank, because a reader needs this factor; the ends do.

    Raises:
        ProcedureFailed: The ends are not those of a blank element after `write.attempts` kicks, or
            do not become quiet.
    """
    attempt = 0
    while not (yield from seems_blank(element)):
        if attempt == element.settings.write.attempts:
            raise ProcedureFailed(f'the element is not blank after {attempt} kicks')
        attempt += 1
        yield from kick_out(element)
    try:
        shot, _ = yield from record_waveforms(element, reader.forecasts, reader.forecasts.end)
    except Astray as error:
        raise ProcedureFailed(str(error)) from error
    return reader.fit_losses(shot, element.settings)


def _find_kick_factors(element: Memory, reader: Reader) -> Procedure[float]:
    """Find and set a factor on the speed of the kick to every level, the middle of those that take
    the wall there; return their geometric mean.

    A level that is not reached has the mean factor. The last level is only tried if the right end
    can kick back a wall that left the element.

    Raises:
        ProcedureFailed: No factor reaches any level, or the element cannot be made blank.
    """
    levels, found = element.design.levels, {}
    # slow kicks need less than the factor on the losses, fast ones more
    factors = [element.calibration.loss_factor * 1.04**power for power in range(-9, 6)]
    last = levels - 1 if element.settings.has_one_transducer else levels
    for level, content in reader.single_walls.items():
        if level >= last:
            continue
        if good := (yield from _try_kicks(element, level, content, factors)):
            found[level] = round(math.sqrt(good[0] * good[-1]), 6)
    if not found:
        raise ProcedureFailed(
            f'no factor from {factors[0]:.2f} to {factors[-1]:.2f} on the speeds of kicks reaches '
            'any level'
        )
    mean = round(math.exp(math.fsum(map(math.log, found.values())) / len(found)), 6)
    _set_corrections(element, [PulseCorrection(speed=found.get(k, mean)) for k in range(levels)])
    return mean


def _try_kicks(
    element: Memory, level: int, content: int, factors: Sequence[float]
) -> Procedure[list[float]]:
    """Return those of some factors that take the wall to a level.

    They rise until it goes too far: a wall that runs against what is behind the last level comes
    back, and what is read then tells nothing.
    """
    good = []
    for factor in factors:
        _set_corrections(element, [PulseCorrection(speed=factor)] * element.design.levels)
        yield from go_to_level(element, UNDECODABLE, level)
        reading = yield from element.reader.read(element)
        if went_too_far(element, reading, content):
            break
        if reading.level == content and reading.level_margin >= element.settings.write.min_margin:
            good.append(factor)
    return good


@calibrate_reader.register
def calibrate_records(reader: RecordReader, element: Memory) -> Procedure[dict[str, Any]]:
    """Find the factor on the speeds of kicks, and record the blank element and every level.

    Every record must be nearest to the forecast of its own content.

    Returns:
        Fields of the result.

    Raises:
        ProcedureFailed: A level was not reached; the old calibration is kept.
    """
    element.reader = reader.by_forecast
    try:
        with _keep_unless_measured(element):
            factors = yield from _find_factors(element, reader.by_forecast)
            records = []
            for content in (BLANK, *reader.single_walls.values()):
                records.append((yield from _record_content(reader, element, content)))
            element.calibration = replace(element.calibration, records=tuple(records))
    finally:
        element.reader = reader
    return {'found': factors}


def _record_content(
    reader: RecordReader, element: Memory, content: int
) -> Procedure[tuple[float, ...]]:
    """Write a content from blank, and record it once its wall has settled.

    Raises:
        ProcedureFailed: The content is not heard after `write.attempts`.
    """
    attempts, nudge, seen = element.settings.write.attempts, 1.0, []
    for attempt in range(1, attempts + 1):
        yield from go_to_level(element, UNDECODABLE, content, nudge=nudge)
        yield from wait_until_pinned(element)
        reading, record = yield from reader.record(element)
        if reading.level == content:
            return record
        nudge *= correct_speed(element, reading, content, attempt)
        seen.append(reading.reason or element.describe_content(reading.level))
    raise ProcedureFailed(
        f'{element.describe_content(content)} was not recorded in {attempts} attempts; heard '
        f'instead: {", ".join(seen)}'
    )


@calibrate_reader.register
def calibrate_delays(reader: DelayReader, element: Memory) -> Procedure[dict[str, Any]]:
    """Measure the delay of every level from both ends.

    The wall is taken up from level to level with the pulses of the settings, times the corrections
    of the calibration. Every new delay must be nearest to that of the same level in the present
    calibration, because a failed step would shift all levels of the table by one. The speed of a
    kick that misses its level is found by bisection, within `write.kick_tries`. A twin's forecast
    takes the place of the present calibration, if there is one.

    Returns:
        Fields of the result.

    Raises:
        ProcedureFailed: The wall did not follow, or the delays do not distinguish the levels; the
            old calibration is kept.
    """
    with _keep_unless_measured(element):
        element.calibration = yield from _measure_delays(element)
    measured = element.calibration
    return {'delays': {end: measured.table(end).delays for end in End}}


def _measure_delays(element: Memory) -> Procedure[Calibration]:
    """Erase, take the wall through all levels, and return the new calibration."""
    element.calibration = element.forecast or element.calibration
    empty = (yield from erase(element)).reading
    blank = empty.delay if empty else None
    corrections = element.calibration.corrections_by_level(element.settings)
    _set_corrections(element, corrections)
    levels: list[Reading] = []
    try:
        for level in range(element.design.levels):
            levels.append((yield from _reach_level(element, level)))
        left = DelayTable(
            tuple(each.left_delay or 0.0 for each in levels),
            shapes=tuple(each.shapes[End.LEFT] for each in levels),
        )
        right = DelayTable(
            tuple(each.right_delay or 0.0 for each in levels),
            blank,
            tuple(each.shapes[End.RIGHT] for each in levels),
        )
        measured = replace(element.calibration, left=left, right=right)
        measured.check(element.design.levels, primary_end(element.settings.read))
    except (ProcedureFailed, SettingsError) as error:
        raise ProcedureFailed(f'the calibration was not taken: {error}') from error
    return measured


def _set_corrections(element: Memory, corrections: list[PulseCorrection]) -> None:
    found = make_corrections(corrections, element.settings)
    element.calibration = replace(element.calibration, pulse_corrections=found)


def _correct_kick(element: Memory, level: int, speed: float) -> None:
    """Set the factor on the speed of the kick to a level; 0: no kick."""
    corrections = element.calibration.corrections_by_level(element.settings)
    corrections[level] = PulseCorrection(speed=speed)
    _set_corrections(element, corrections)


def _reach_level(element: Memory, level: int) -> Procedure[Reading]:
    """Take the wall up to a level from the one below, and listen.

    A level that no kick reaches is reached by a step, if there is an actuator.

    Raises:
        ProcedureFailed: The wall is not at the level.
    """
    below = level - 1 if level else BLANK
    kick = element.calibration.corrections_by_level(element.settings)[level].speed
    if kick and is_kicked(element.settings, level):
        reading = yield from _bisect_kick(element, level)
        if reading is not None:
            return reading
        _correct_kick(element, level, 0.0)
        yield from erase(element)
        yield from go_to_level(element, BLANK, below)
        yield from wait_until_pinned(element)
    yield from go_to_level(element, below, level, plainly=True)
    reading = yield from element.reader.read(element)
    margin, reason = _level_margin(element, level, reading)
    least = element.settings.write.min_margin
    if margin < least:
        reason = reason or f'the step to level {level} has a margin of {margin:.2f}, below {least}'
        raise ProcedureFailed(reason)
    return reading


def _bisect_kick(element: Memory, level: int) -> Procedure[Reading | None]:
    """Kick the wall to a level, at other speeds if it misses; return None if a step must do.

    After a miss the wall continues from where it is, or from a blank element.

    Raises:
        ProcedureFailed: No speed takes the wall to the level, and no step can.
    """
    settings, place = element.settings, level - 1 if level else BLANK
    speed = element.calibration.corrections_by_level(settings)[level].speed
    search = KickSearch(speed, settings.write.kick_tries)
    while True:
        if not BLANK <= place < level:
            yield from erase(element)
            place = BLANK
        yield from go_to_level(element, place, level)
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
        return margin > -math.inf and margin >= self._enough

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
    """Return whether a wall is heard beyond a level, 1, short of it, -1, or neither, 0."""
    if element.phase(End.LEFT) == 0:
        return -1  # it fell back
    if element.phase(End.RIGHT) == 1:
        return 1  # it ran out
    for end in End:
        delay = reading.left_delay if end is End.LEFT else reading.right_delay
        if delay is not None:
            late = delay - element.calibration.table(end).delays[level]
            return int(math.copysign(1.0, late if end is End.LEFT else -late))
    return 0


def _level_margin(element: Memory, level: int, reading: Reading) -> tuple[float, str]:
    """Return the margin with which the end that names levels hears one, or why an end does not.

    The reading itself does not say, because the calibration may be off while it is measured.
    """
    calibration, margin = element.calibration, 1.0
    for end in End:
        delay = reading.left_delay if end is End.LEFT else reading.right_delay
        if delay is None:
            return -math.inf, f'level {level} gives no echo at the {end} end'
        nearest, clear = calibration.table(end).find_nearest(delay)
        if end is primary_end(element.settings.read):
            margin, right = clear, nearest == level
        else:
            probe = element.transducer.probes[end]
            shape = reading.shapes[end]
            # The wall still swings: the other end says which of two that sound alike here.
            agreed, _ = measure_agreement(
                element.design, calibration, probe, end, level, delay, shape
            )
            # least margin at the end that does not name levels: far from it, delays of an
            # element that is not yet calibrated differ most
            right = agreed >= 0.2
        if not right:
            said = f'{describe_level(nearest)}, at {delay:.2f}'
            return -math.inf, f'on the way to level {level} the {end} end hears {said}'
    return margin, ''
