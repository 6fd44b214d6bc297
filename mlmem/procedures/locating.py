# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Locating: where the wall is, between levels too, from the delays at both ends."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import singledispatch

import numpy as np

from ..commands import Outcome
from ..errors import ProcedureFailed, SettingsError
from ..instrument.blocks import Procedure
from ..instrument.echo import Echo
from ..instrument.end import End
from ..memory import Memory
from ..physics.potential import Array
from ..physics.waves import group_velocity
from ..readers.calibration import DelayTable
from ..readers.decoding import MAX_THRESHOLD_FACTOR, WALL_GONE_REASON
from ..readers.delay_reader import DelayReader
from ..readers.listening import probe_ends, record_waveforms, wait_for_decay
from ..readers.reader import Reader
from ..readers.reading import BLANK, UNDECODABLE, Reading

WELL_ERROR_CELLS = 0.25
"""Error from the well in which a wall rests, in cells: it shifts the echo of a wall between levels
by up to 0.4 cells from that of a level."""


def locate(element: Memory) -> Procedure[Outcome]:
    """Find the walls of an element, as its reader can; see `locate_walls` and `locate_by_delays`.

    Raises:
        ProcedureFailed: The walls cannot be located.
    """
    return (yield from locate_walls(element.reader, element))


@singledispatch
def locate_walls(reader: Reader, element: Memory) -> Procedure[Outcome]:
    """Read the content, and answer where its walls are: at levels, or nowhere.

    Found are `walls`; of one wall its `position` and `position_std` in cells from the left; and of
    a register the `cells` and `kinds` of all, from the left.

    Raises:
        ProcedureFailed: The content cannot be decoded.
    """
    reading = yield from reader.read(element)
    if reading.level == UNDECODABLE:
        raise ProcedureFailed(reading.reason, code=reading.failure_code)
    sites = [element.design.defect_site(level) for level in reader.list_walls(reading.level)]
    found: dict[str, float | str] = {'walls': len(sites)}
    if reader.holds_words:
        kinds = ('wall', 'kink') * len(sites)
        found['cells'] = ' '.join(map(str, sites))
        found['kinds'] = ' '.join(reversed(kinds[: len(sites)]))  # they alternate from the right
    elif sites:
        found |= {'position': float(sites[0]), 'position_std': WELL_ERROR_CELLS}
    return Outcome(reading, found=found)


@locate_walls.register
def locate_by_delays(reader: DelayReader, element: Memory) -> Procedure[Outcome]:
    """Probe from every end, and turn delays into cells between the levels of the calibration.

    Found are `walls`, 0 or 1, and of a wall `position` and `position_std` in cells from the left.
    Both ends must hear the wall at the same place. Where only one end tells the place, a read must
    prove the level, and the error is that which a read allows. In a blank element it is the site
    of a `stuck_cell` instead, as `element.bad_cells` takes it. A read that follows knows no more
    than before.

    Raises:
        ProcedureFailed: The base shakes, an echo is missing or unclear, the wall has left, the
            ends hear different places, there are two walls or more, or an end rests in neither
            phase.
    """
    yield from wait_for_decay(element)
    phases = {end: element.phase(end) for end in End}
    echoes = yield from probe_ends(element, _find_detecting_ends(element, phases))
    reading = element.store_echoes(echoes)
    if any(echo.shaken for echo in echoes.values()):
        raise ProcedureFailed('the base shakes: hold it still to locate a wall')
    for end, echo in echoes.items():
        if echo.delay is None or echo.threshold_factor > MAX_THRESHOLD_FACTOR:
            reason = reading.reason or f'the echo at the {end} end is unclear'
            raise ProcedureFailed(reason, code=reading.failure_code)
    if reading.level == BLANK:
        return Outcome(reading, found={'walls': 0})
    if phases[End.LEFT] == 0 and (
        cell := (yield from _find_stuck_cell(element, echoes[End.RIGHT]))
    ):
        return Outcome(reading, found={'walls': 0, 'stuck_cell': cell})
    if phases[End.LEFT] == phases[End.RIGHT]:
        raise ProcedureFailed(reading.reason, code=reading.failure_code)
    position, deviation = _combine_places(element, reading, echoes)
    found = {'position': round(position, 3), 'position_std': round(deviation, 3)}
    return Outcome(reading, found={'walls': 1, **found})


def _find_stuck_cell(element: Memory, echo: Echo) -> Procedure[int]:
    """Return the site of the stuck cell that answers in a blank element, or 0 if it is none.

    It answers to the right end as a wall some cells beside it does; so the waveforms of a pulse
    are compared with the forecast for every cell about there.
    """
    from ..readers.bad_cells import forecast_stuck_cells  # few elements have one

    design = element.design
    reach = 20  # cells by which a stuck cell may be from the wall with the same echo
    if echo.is_early:  # behind the last level, or the element is short
        sites = range(max(2, design.defect_site(design.levels - 1) - reach), design.N)
    else:
        where = round(_locate_reflector(element, echo)[0])
        sites = range(max(2, where - reach), min(where + reach, design.N))
    try:
        forecasts = forecast_stuck_cells(design, element.settings, sites)
    except SettingsError:
        return 0
    shot, noise = yield from record_waveforms(element, forecasts)
    least = element.settings.register.min_margin
    return max(0, forecasts.decode(shot, noise, (0, 0), least).level)


def _find_detecting_ends(element: Memory, phases: dict[End, int | None]) -> tuple[End, ...]:
    """Return the ends that hear a wall: each in the phase that its pulse passes."""
    for end, phase in phases.items():
        if phase is None:
            raise ProcedureFailed(f'the {end} end rests in neither phase')
    able = [end for end in End if phases[end] == (end is End.LEFT)]
    if not able:
        raise ProcedureFailed(WALL_GONE_REASON)
    return tuple(able)


def _locate_reflector(element: Memory, echo: Echo) -> tuple[float, float]:
    """Return the position of what an echo comes from, in cells, and its standard deviation.

    Straight lines lead from level to level and beyond the outermost. Their error is a quarter of
    that which they would have at a level left out, for their intervals are half as wide; that of
    the delay is a sample, and noise over the slope of v_c where it crosses the threshold.
    """
    design, end = element.design, echo.end
    table: DelayTable = element.calibration.table(end)
    order = np.argsort(table.delays)
    delays = np.asarray(table.delays)[order]
    sites = np.array([design.defect_site(level) for level in range(design.levels)], dtype=float)[
        order
    ]
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
        bend = _interpolation_error(delays, sites)
    return position, math.hypot(WELL_ERROR_CELLS, slope * timing, bend)


def _interpolation_error(delays: Array, sites: Array) -> float:
    """Return the error of straight lines between three levels or more, in cells."""
    share = (delays[1:-1] - delays[:-2]) / (delays[2:] - delays[:-2])
    drawn = sites[:-2] + share * (sites[2:] - sites[:-2])
    return float(np.sqrt(np.mean((drawn - sites[1:-1]) ** 2)) / 4.0)


def _combine_places(
    element: Memory, reading: Reading, echoes: Mapping[End, Echo]
) -> tuple[float, float]:
    """Return position and deviation of the wall that the ends hear.

    An echo that begins before listening does comes from near its end, but does not say how near.

    Raises:
        ProcedureFailed: The ends hear different places, or one alone is not confirmed by a read.
    """
    # standard deviations within which both ends detect the same wall, and within which it is
    most = 3.0
    heard = {
        end: _locate_reflector(element, echo) for end, echo in echoes.items() if not echo.is_early
    }
    if len(heard) == 2:
        (left, left_std), (right, right_std) = heard[End.LEFT], heard[End.RIGHT]
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
        raise ProcedureFailed(reading.reason, code=reading.failure_code)
    if not heard:
        raise ProcedureFailed('something is heard at both ends when listening begins')
    ((position, deviation),) = heard.values()
    allowed = 0.5 * element.design.J * (1.0 - element.settings.read.min_margin)
    return position, math.hypot(deviation, allowed / most)
