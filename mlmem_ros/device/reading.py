# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Decoding: from an echo to the stored level, with margins, or to 'blank' or 'undecodable'."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..physics import Design
from .calibration import Calibration
from .echo import Echo
from .settings import ReadSettings

BLANK = -1
"""Level of an element with no wall."""

UNDECODABLE = -2
"""Level of an answer that would be a guess."""

REST_TOLERANCE = 0.25
"""Largest departure of a rest displacement from a ground state, as a share of their distance."""


@dataclass(frozen=True)
class Reading:
    """A decoded echo.

    Attributes:
        level: 0 ... p - 1, `BLANK` or `UNDECODABLE`.
        code: Binary code of a level; empty otherwise.
        end: The end that was probed.
        delay: Echo delay in time units, or None where nothing came back.
        level_margin: 1 on the calibrated delay, 0 half-way to the next level.
        threshold_margin: Greatest v_c over the threshold; above 1 for an echo.
        distance: Distance from the end to the wall in cells; infinite where nothing came back.
        reason: Why it could not be decoded; empty otherwise.
    """

    level: int
    code: str
    end: str
    delay: float | None
    level_margin: float
    threshold_margin: float
    distance: float
    reason: str = ''


def phase_of(design: Design, rest: float) -> int | None:
    """Return the phase of an end: 0 inactive, 1 active, None in between.

    Args:
        design: The element.
        rest: Rest displacement of the end less that of the substrate under it.
    """
    active = (rest - design.D_s1) / (design.D_s2 - design.D_s1)
    phase = round(active)
    return phase if phase in (0, 1) and abs(active - phase) <= REST_TOLERANCE else None


def decode(
    design: Design,
    settings: ReadSettings,
    calibration: Calibration,
    echo: Echo,
    phases: tuple[int | None, int | None],
) -> Reading:
    """Decode an echo.

    The rest displacements of the ends tell their phases. A stored level has the active phase
    at the left and the inactive one at the right; a blank element has the inactive phase at
    both and echoes, seen from the right, from its far end.

    Args:
        design: The element.
        settings: Least margin of a decodable level.
        calibration: Delays by level.
        echo: What came back.
        phases: Phases of the left and the right end (see `phase_of`).
    """
    if None in phases:
        end = 'left' if phases[0] is None else 'right'
        return _undecodable(echo, f'the {end} end rests in neither phase')
    if phases[1] == 1:
        return _undecodable(echo, 'the right end is active: the wall has left the element')
    if echo.end == 'left' and phases[0] == 0:
        return _undecodable(echo, 'the left end is inactive and hears nothing: probe the right')
    if echo.delay is None:
        return _undecodable(echo, 'no echo came back')
    level, margin = calibration.table(echo.end).nearest(echo.delay)
    if margin < settings.min_margin:
        return _undecodable(
            echo, f'the delay {echo.delay:.2f} lies between levels (margin {margin:.2f})'
        )
    if (level == BLANK) != (phases[0] == 0):
        return _undecodable(
            echo,
            f'the left end is {"active" if phases[0] else "inactive"}, but the delay '
            f'{echo.delay:.2f} from the {echo.end} is that of a '
            f'{"blank element" if level == BLANK else f"wall at level {level}"}',
        )
    code = design.code(level) if level >= 0 else ''
    distance = _distance(design, calibration, echo.end, echo.delay) if level >= 0 else math.inf
    return Reading(level, code, echo.end, echo.delay, margin, echo.threshold_margin, distance)


def _distance(design: Design, calibration: Calibration, end: str, delay: float) -> float:
    first = 1 if end == 'left' else design.N
    distances = [abs(design.defect(level) - first) for level in range(design.levels)]
    return calibration.table(end).distance(delay, distances)


def _undecodable(echo: Echo, reason: str) -> Reading:
    return Reading(
        UNDECODABLE, '', echo.end, echo.delay, 0.0, echo.threshold_margin, math.inf, reason
    )
