# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reading one wall by the delay of its echoes, as in the paper; calibrating it, which takes the
wall through all levels and bisects speeds of kicks; and locating it.

A pulse of either end is reflected by the wall. Both ends listen at the same time, for both must
detect the same wall (see `decoding.Decoder`).
"""

from __future__ import annotations

import math
from collections.abc import Generator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..commands import Outcome
from ..errors import Astray, ProcedureFailed, SettingsError
from ..instrument.blocks import Procedure
from ..instrument.echo import ECHO_TAIL_TIME, Echo
from ..instrument.end import End
from ..physics import Design
from ..physics.waves import group_velocity
from .calibration import DelayTable, PulseCorrection
from .decoding import MAX_THRESHOLD_FACTOR, WALL_GONE_REASON, Decoder, explain_no_phase
from .listening import probe_ends, record_waveforms, wait_for_decay, wait_until_pinned
from .reader import Reader, Writer
from .reading import BLANK, UNDECODABLE, WELL_ERROR_CELLS, Reading, describe_level

if TYPE_CHECKING:
    from ..memory import Memory


MIN_KICK_MARGIN = 0.7
"""Least level margin of a wall that a kick took to its level; one that stopped on its way has at
most 0.6."""


class DelayReader(Reader):
    """Decodes the level of one wall from the delays at both ends; see `Reader`."""

    def __init__(self, design: Design) -> None:
        """Make the reader of a design."""
        super().__init__({BLANK: (), **{level: (level,) for level in range(design.levels)}})

    def read_duration(self, element: Memory) -> float:
        """Return the time for the longest echo, and the rest before it."""
        longest = max(element.calibration.table(end).longest_delay for end in End)
        return element.settings.read.rest + longest + ECHO_TAIL_TIME

    def read(self, element: Memory, end: str = '') -> Procedure[Reading]:
        """Probe both ends and decode the echoes; while the base shakes, until they are decoded.

        The left end's carrier lies above the band of the inactive phase and so cannot leave the
        left end of a blank element, and vice versa: then only the other end is probed.

        Raises:
            ProcedureFailed: The element does not come to rest, or listening was interrupted.
        """
        for _ in range(element.settings.read.attempts):
            yield from wait_for_decay(element)
            try:
                echoes = yield from probe_ends(element, _find_detecting_ends(element))
            except Astray as error:
                return element.store_unreadable(str(error))
            reading = _store_echoes(element, echoes, end)
            shaken = any(echo.shaken for echo in echoes.values())
            if not shaken or reading.level != UNDECODABLE or reading.walls is not None:
                break
        return reading

    def _needs_second_read(self, reading: Reading) -> bool:
        """Return whether both ends detect an echo, but not of the same wall."""
        delays = reading.left_delay, reading.right_delay
        return reading.level == UNDECODABLE and None not in delays

    def calibrate(self, element: Memory, writer: Writer) -> Procedure[dict[str, Any]]:
        """Measure the delay of every level from both ends.

        The wall is taken up from level to level with the pulses of the settings, times the
        corrections of the calibration. Every new delay must be nearest to that of the same level
        in the present calibration, because a failed step would shift all levels of the table by
        one. The speed of a kick that misses its level is found by bisection, within
        `write.kick_tries`. A twin's forecast takes the place of the present calibration, if there
        is one.

        Raises:
            ProcedureFailed: The wall did not follow, or the delays do not distinguish the levels.
        """
        levels: list[Reading] = []
        element.calibration = element.forecast or element.calibration
        empty = (yield from writer.erase(element)).reading
        blank = empty.delay if empty else None
        element.correct_pulses(element.pulse_corrections)
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
        element.calibration = measured
        return {'delays': {end: measured.table(end).delays for end in End}}

    def locate(self, element: Memory) -> Procedure[Outcome]:
        """Probe from every end, and turn delays into cells between the levels of the calibration.

        Found are `walls`, 0 or 1, and of a wall `position` and `position_std` in cells from the
        left. Both ends must detect the wall at the same place. Where only one end shows the place,
        a read must prove the level, and the error is that which a read allows. In a blank element
        it is the site of a `stuck_cell` instead, as `element.bad_cells` takes it. A read that
        follows knows no more than before.

        Raises:
            ProcedureFailed: The base shakes, an echo is missing or unclear, the wall has left, the
                ends detect different places, there are two walls or more, or an end rests in
                neither phase.
        """
        yield from wait_for_decay(element)
        phases = element.phases
        if reason := explain_no_phase(phases):
            raise ProcedureFailed(reason)
        if phases == (0, 1):
            raise ProcedureFailed(WALL_GONE_REASON)
        echoes = yield from probe_ends(element, _find_detecting_ends(element))
        reading = _store_echoes(element, echoes)
        if any(echo.shaken for echo in echoes.values()):
            raise ProcedureFailed('the base shakes: hold it still to locate a wall')
        for end, echo in echoes.items():
            if echo.delay is None or echo.threshold_factor > MAX_THRESHOLD_FACTOR:
                raise ProcedureFailed(reading.reason or f'the echo at the {end} end is unclear')
        if reading.level == BLANK:
            return Outcome(reading, found={'walls': 0})
        if phases[0] == 0 and (cell := (yield from _find_stuck_cell(element, echoes[End.RIGHT]))):
            return Outcome(reading, found={'walls': 0, 'stuck_cell': cell})
        if phases != (1, 0):
            raise ProcedureFailed(reading.reason)
        position, deviation = _combine_places(element, reading, echoes)
        found = {'position': round(position, 3), 'position_std': round(deviation, 3)}
        return Outcome(reading, found={'walls': 1, **found})


def _find_detecting_ends(element: Memory) -> tuple[End, ...]:
    """Return the ends that can detect something: both, if the wall lies between their phases."""
    if element.phase(End.LEFT) == 0:
        return (End.RIGHT,)
    if element.phase(End.RIGHT) == 1:
        return (End.LEFT,)
    return tuple(End)


def _store_echoes(element: Memory, echoes: Mapping[End, Echo], end: str = '') -> Reading:
    """Decode the echoes at the ends, store the reading and report it.

    `end` is the one whose delay is reported; empty for the one in the settings.
    """
    decoder = Decoder(element.design, element.settings.read, element.calibration)
    reading = decoder.decode(echoes, element.phases, end)
    last = End.RIGHT if reading.end == End.RIGHT else End.LEFT  # which is reported
    in_order = sorted(echoes.values(), key=lambda echo: echo.end is last)
    reading = element.store_reading(reading, in_order)
    if reading.level != UNDECODABLE:  # all that is under way was seen
        for each in echoes:
            element.transducer.reverberation[each].mark_returned()
    return reading


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
    search = search_speed(element.pulse_corrections[level].speed, settings.write.kick_tries)
    next(search)  # the speed of the calibration comes first
    while True:
        if not BLANK <= place < level:
            yield from writer.erase(element)
            place = BLANK
        yield from writer.go_to_level(element, place, level)
        yield from wait_until_pinned(element)
        reading = yield from element.reader.read(element)
        margin, reason = _level_margin(element, level, reading)
        try:
            speed = search.send((margin, _find_side(element, level, reading)))
        except StopIteration as stop:
            if stop.value:
                return reading
            break
        _correct_kick(element, level, speed)
        near = reading.level if reading.level_margin >= MIN_KICK_MARGIN else UNDECODABLE
        place = near if near < level else UNDECODABLE
    if level and settings.actuator.present:
        return None
    raise ProcedureFailed(reason or f'no kick takes the wall to level {level} again')


def search_speed(speed: float, tries: int) -> Generator[float, tuple[float, int], bool]:
    """Search for the speed of a kick: slower if the wall went too far, faster if it fell short.

    Yields factors on the speed in the settings, the given one first. Each receives the level
    margin of the wall after a kick, and its side: 1 beyond its level, -1 short of it, 0 there. A
    low margin means that the wall stopped on its way. If no speed takes it to the level, the one
    that took it nearest is yielded once more.

    Returns:
        Whether the wall has arrived at the last.
    """
    nearest, best, short, far, faster = -math.inf, speed, 0.0, math.inf, True
    while True:
        margin, side = yield speed
        if margin >= MIN_KICK_MARGIN:
            return True
        if margin > nearest:
            nearest, best = margin, speed
        if side > 0:
            far = min(far, speed)
        elif side < 0:
            short = max(short, speed)
        if short and far < math.inf:
            other = math.sqrt(short * far)
        else:  # step by a tenth towards it
            other = speed * 1.1 ** -((1 if faster else -1) * (side or 1))
            if faster and not 1.0 / 1.8 < other < 1.8:
                # The fastest kicks fall short again: the speed may lie on the other side.
                short, far, faster = 0.0, math.inf, False
                other = 1.1 if other < 1.0 else 1.0 / 1.1
        tries -= 1
        closed = far < 1.004 * short  # nothing between is worth a try
        if tries <= 0 or closed or not 0.1 <= other <= 10.0:
            break
        speed = other
    if nearest == -math.inf:
        return False
    margin, _ = yield best
    return margin >= nearest - 0.1  # level margins of a wall at the same place differ by less


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


def _find_stuck_cell(element: Memory, echo: Echo) -> Procedure[int]:
    """Return the site of the stuck cell that answers in a blank element, or 0 if it is none.

    It answers to the right end as a wall some cells beside it does; so the waveforms of a pulse
    are compared with the forecast for every cell about there.
    """
    from .bad_cells import forecast_stuck_cells  # few elements have one

    design = element.design
    reach = 20  # cells by which a stuck cell may be from the wall with the same echo
    if echo.is_early:  # behind the last level, or the element is short
        sites = range(max(2, design.defect_site(design.levels - 1) - reach), design.N)
    else:
        where = round(locate_reflector(element, echo)[0])
        sites = range(max(2, where - reach), min(where + reach, design.N))
    try:
        forecasts = forecast_stuck_cells(design, element.settings, sites)
    except SettingsError:
        return 0
    shot, noise = yield from record_waveforms(element, forecasts)
    least = element.settings.register.min_margin
    return max(0, forecasts.decode(shot, noise, (0, 0), least).level)


def locate_reflector(element: Memory, echo: Echo) -> tuple[float, float]:
    """Return the position of what an echo comes from, in cells, and its standard deviation.

    Straight lines lead from level to level and beyond the outermost. Their error is a quarter of
    that which they would have at a level left out, for their intervals are half as wide; that of
    the delay is a sample, and noise over the slope of v_c where it crosses the threshold.
    """
    design, end = element.design, echo.end
    table = element.calibration.table(end)
    order = np.argsort(table.delays)
    delays = np.asarray(table.delays)[order]
    sites = np.array([float(design.defect_site(level)) for level in order])
    assert echo.delay is not None
    away = 1.0 if end is End.LEFT else -1.0
    if len(delays) == 1:
        slope = 0.5 * away * float(group_velocity(echo.probe.omega_c, end.k_s(design)))
        below = 0
    else:
        below = int(np.clip(np.searchsorted(delays, echo.delay) - 1, 0, len(delays) - 2))
        slope = float(np.diff(sites)[below] / np.diff(delays)[below])
    position = float(sites[below] + slope * (echo.delay - delays[below]))
    step = float(echo.t[1] - echo.t[0])
    at = int(np.searchsorted(echo.t, echo.delay))
    rising = max(0.0, float(np.gradient(echo.v_c[max(0, at - 2) : at + 3], step).mean()))
    timing = math.hypot(step, echo.floor / rising if echo.floor else 0.0)
    if len(delays) < 3:  # nothing is known between them
        bend = min(float(np.abs(sites - position).min()), design.J / math.sqrt(12.0))
    else:
        share = (delays[1:-1] - delays[:-2]) / (delays[2:] - delays[:-2])
        drawn = sites[:-2] + share * (sites[2:] - sites[:-2])
        bend = float(np.sqrt(np.mean((drawn - sites[1:-1]) ** 2)) / 4.0)
    return position, math.hypot(WELL_ERROR_CELLS, slope * timing, bend)


def _combine_places(
    element: Memory, reading: Reading, echoes: Mapping[End, Echo]
) -> tuple[float, float]:
    """Return position and deviation of the wall that the ends detect.

    An echo that begins before listening does comes from near its end, but does not say how near.
    """
    # standard deviations within which both ends detect the same wall, and within which it is
    most = 3.0
    places = {
        end: locate_reflector(element, echo) for end, echo in echoes.items() if not echo.is_early
    }
    if len(places) == 2:
        (left, left_std), (right, right_std) = places[End.LEFT], places[End.RIGHT]
        if abs(left - right) > most * math.hypot(left_std, right_std):
            raise ProcedureFailed(
                f'the left end hears something near cell {left:.1f}, and the right end near cell '
                f'{right:.1f}: an end errs, something else answers, or there are three walls'
            )
        weights = np.array([left_std, right_std]) ** -2.0
        position = float(np.average([left, right], weights=weights))
        either = (left - right) / most  # whichever end errs is off by no more
        return position, math.hypot(float(weights.sum() ** -0.5), either)
    if reading.level == UNDECODABLE:
        raise ProcedureFailed(reading.reason)
    if not places:
        raise ProcedureFailed('something is heard at both ends when listening begins')
    ((position, deviation),) = places.values()
    allowed = 0.5 * element.design.J * (1.0 - element.settings.read.min_margin)
    return position, math.hypot(deviation, allowed / most)
