# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Decoding: from an echo to the stored level, with margins, or to 'blank' or 'undecodable'."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from ..physics import Design
from ..words import BLANK as BLANK
from ..words import UNDECODABLE as UNDECODABLE
from ..words import describe_level as describe_level
from .calibration import Calibration
from .echo import Echo
from .end import BOTH, End
from .settings import ReadSettings

REST_TOLERANCE = 0.25
"""Largest offset of a rest displacement from a ground state, as a fraction of their distance."""

MOST_RAISED = 1.4
"""Most by which noise may raise the threshold. Beyond, an echo's slow flank crosses it so late
that the delay may be that of the next level."""


@dataclass(frozen=True)
class Reading:
    """A decoded echo, or the echoes from both ends.

    Attributes:
        level: 0 ... p - 1, `BLANK` or `UNDECODABLE`.
        code: Binary code of a level; empty otherwise.
        end: The end that was probed: 'left', 'right' or 'both'.
        delay: Echo delay in time units, or None without an echo; for both ends, at the left.
        level_margin: 1 at the calibrated delay, 0 half-way to the next level. For both ends the
            lesser margin, and at most 1 - e / (J / 2), where e is the number of cells by which
            the sum of the two distances differs from the element, and J the spacing of levels.
        threshold_margin: Greatest v_c over the threshold; above 1 for an echo. For both ends the
            lesser.
        distance: Distance from the end to the wall in cells; infinite without an echo. For both
            ends, from the left.
        reason: Why it could not be decoded; empty otherwise.
        walls: Number of walls, as far as the ends can tell: 0, 1, 2 or 3 (three or more); None if
            one end cannot distinguish one wall from three.
        right_delay: Echo delay at the right end if both were probed.
    """

    level: int
    code: str
    end: str
    delay: float | None
    level_margin: float
    threshold_margin: float
    distance: float
    reason: str = ''
    walls: int | None = None
    right_delay: float | None = None

    @property
    def confidence(self) -> float:
        """See the function `confidence`; 0 if nothing was decoded."""
        if self.level == UNDECODABLE:
            return 0.0
        return confidence(self.level_margin, self.threshold_margin)


def confidence(level_margin: float, threshold_margin: float) -> float:
    """Return how much may be lost before the answer changes, from 0 to 1.

    The lesser of two fractions: how far the delay may still shift on the way to the next level
    (the level margin), and how much of its height the echo may still lose before it is missed
    (1 - 1 / threshold margin).
    """
    if threshold_margin <= 1.0:
        return 0.0
    return max(0.0, min(level_margin, 1.0 - 1.0 / threshold_margin))


def phase_of(design: Design, rest: float) -> int | None:
    """Return the phase of an end: 0 inactive, 1 active, None in between.

    `rest` is the rest displacement of the end minus that of the substrate under it, in cells.
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
    """Decode an echo, given the phases of the left and the right end (see `phase_of`).

    A stored level has the active phase at the left end and the inactive one at the right. A blank
    element is inactive at both, and its far end returns the echo of a probe from the right. If
    both ends have the same phase and an echo comes from within, there are two walls between them.
    """
    nothing = Reading(
        UNDECODABLE, '', echo.end.value, echo.delay, 0.0, echo.threshold_margin, math.inf
    )
    if reason := _unclear(calibration, echo, phases):
        return replace(nothing, reason=reason)
    assert echo.delay is not None
    # The two farthest echoes may be alike; the phase of the left end distinguishes them: with a
    # kink behind it there is no wall at the first defect.
    impossible = BLANK if phases[0] == 1 else 0
    level, margin = calibration.table(echo.end).nearest(echo.delay, impossible)
    if echo.early and margin < 1.0:  # unless the calibrated delay of a level is that short
        return replace(
            nothing,
            reason=f'something is heard at the {echo.end} end when listening begins, at '
            f'{echo.delay:.2f}, and no level is so near',
        )
    least = max(settings.min_margin, settings.shaken_margin if echo.shaken else 0.0)
    if phases[1] == 1:
        if margin < least:
            return replace(nothing, reason=LEFT, walls=0)
        return replace(
            nothing,
            reason='the right end is active, but the left one hears a wall at level '
            f'{level}: there are two walls, or more',
            walls=2,
        )
    if margin < least:
        return replace(
            nothing, reason=f'the delay {echo.delay:.2f} lies between levels (margin {margin:.2f})'
        )
    if level == BLANK:
        return replace(nothing, level=BLANK, level_margin=margin, walls=0)
    if phases[0] == 0:
        return replace(
            nothing,
            reason=f'the left end is inactive, but the delay {echo.delay:.2f} from the right is '
            f'that of a wall at level {level}: there are two walls, or more',
            walls=2,
        )
    distances = [echo.end.distance(design, each) for each in range(design.levels)]
    return replace(
        nothing,
        level=level,
        code=design.code(level),
        level_margin=margin,
        distance=calibration.table(echo.end).distance(echo.delay, distances),
    )


LEFT = 'the right end is active: the wall has left the element'


def _unclear(calibration: Calibration, echo: Echo, phases: tuple[int | None, int | None]) -> str:
    """Return why an echo has no delay that can be decoded; empty if it has one."""
    end, what = echo.end, 'shaking' if echo.shaken else 'noise'
    if None in phases:
        return f'the {End.LEFT if phases[0] is None else End.RIGHT} end rests in neither phase'
    if end is End.LEFT and phases[0] == 0:
        return 'the left end is inactive and hears nothing: probe the right'
    if end not in calibration.ends:
        return f'the {end} end is not read from (read.end is right)'
    if end is End.RIGHT and phases[1] == 1:
        return LEFT
    if echo.spoiled:
        return f'the base began to shake while the {end} end listened'
    if echo.delay is None and echo.raised > 1.0:
        return (
            f'no echo rises above the {what} at the {end} end: that gives a v_c of up to '
            f'{echo.floor:.2g} and raises the threshold up to {echo.raised:.2g} times'
        )
    if echo.delay is None:
        return 'no echo came back'
    if echo.raised > MOST_RAISED:
        return (
            f'the {what} at the {end} end hides when the echo began: it raises the threshold '
            f'{echo.raised:.2g} times, and a delay is reliable up to {MOST_RAISED:g} times'
        )
    return ''


def combine(design: Design, settings: ReadSettings, left: Reading, right: Reading) -> Reading:
    """Combine the readings from both ends.

    From either end a single wall is at the same level, and its two distances add up to the
    element. Of three walls, the left end hears the first and the right end the last.
    """
    both = replace(
        left,
        end=BOTH,
        right_delay=right.delay,
        level_margin=min(left.level_margin, right.level_margin),
        threshold_margin=min(left.threshold_margin, right.threshold_margin),
    )
    if UNDECODABLE in (left.level, right.level):
        said = [
            f'{each.end}: {each.reason or describe_level(each.level)}' for each in (left, right)
        ]
        walls = max(each.walls or 0 for each in (left, right)) or None
        return _refused(both, '; '.join(said), walls)
    if left.level < right.level:
        return _refused(
            both,
            f'the left end hears a wall at level {left.level} and the right end one at level '
            f'{right.level}: there are three walls, or more',
            walls=3,
        )
    length, seen = design.N - 1.0, left.distance + right.distance
    fit = 1.0 - abs(seen - length) / (0.5 * design.J)
    if left.level > right.level or fit < settings.min_margin:
        return _refused(
            both,
            f'the ends do not hear the same wall: level {left.level} is {left.distance:.1f} '
            f'cells from the left and level {right.level} {right.distance:.1f} from the right, '
            f'{seen:.1f} of {length:g} in all',
        )
    return replace(both, level_margin=min(both.level_margin, fit), walls=1)


def confirmed(reading: Reading, said: Sequence[int]) -> Reading:
    """Return a reading of a shaken element if two pulses agree, otherwise an undecodable one.

    `said` are the levels read by all pulses, this one last.
    """
    if reading.level == UNDECODABLE or reading.level in said[:-1]:
        return reading
    heard = ', '.join(map(describe_level, said))
    return _refused(reading, f'while the base shakes two pulses must agree: {heard}')


def _refused(reading: Reading, reason: str, walls: int | None = None) -> Reading:
    return replace(
        reading,
        level=UNDECODABLE,
        code='',
        level_margin=0.0,
        distance=math.inf,
        reason=reason,
        walls=walls,
    )
