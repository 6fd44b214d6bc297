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
"""Largest departure of a rest displacement from a ground state, as a share of their distance."""


MOST_RAISED = 1.4
"""How far noise may raise the threshold: beyond, an echo's slow flank crosses it so late that
its delay may be that of the next level."""


@dataclass(frozen=True)
class Reading:
    """A decoded echo, or the echoes from both ends.

    Attributes:
        level: 0 ... p - 1, `BLANK` or `UNDECODABLE`.
        code: Binary code of a level; empty otherwise.
        end: The end that was probed: 'left', 'right' or 'both'.
        delay: Echo delay in time units, or None where nothing came back; of both, the left's.
        level_margin: 1 on the calibrated delay, 0 half-way to the next level. Of both ends the
            lesser, and not more than 1 less the cells by which the two distances do not make up
            the element, over half the spacing of levels.
        threshold_margin: Greatest v_c over the threshold; above 1 for an echo. Of both ends the
            lesser.
        distance: Distance from the end to the wall in cells; infinite where nothing came back.
            Of both, from the left.
        reason: Why it could not be decoded; empty otherwise.
        walls: How many walls the element has, as far as the ends tell: 0, 1, 2 or 3 (3: three
            or more); None where one end alone cannot tell one wall from three.
        right_delay: Echo delay at the right end where both were probed.
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
        """See the function `confidence`; 0 where nothing was decoded."""
        if self.level == UNDECODABLE:
            return 0.0
        return confidence(self.level_margin, self.threshold_margin)


def confidence(level_margin: float, threshold_margin: float) -> float:
    """Return how much may be lost before the answer changes, from 0 to 1.

    The lesser of two shares: that of the way to the next level by which the delay may yet
    shift (the level margin), and that of its height by which the echo may yet fade until it
    is missed (1 - 1 / threshold margin).
    """
    if threshold_margin <= 1.0:
        return 0.0
    return max(0.0, min(level_margin, 1.0 - 1.0 / threshold_margin))


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
    both and echoes, seen from the right, from its far end. Ends of the same phase with an echo
    from within have two walls between them.

    Args:
        design: The element.
        settings: Least margin of a decodable level.
        calibration: Delays by level.
        echo: What came back.
        phases: Phases of the left and the right end (see `phase_of`).
    """
    if None in phases:
        end = End.LEFT if phases[0] is None else End.RIGHT
        return _undecodable(echo, f'the {end} end rests in neither phase')
    if echo.end is End.LEFT and phases[0] == 0:
        return _undecodable(echo, 'the left end is inactive and hears nothing: probe the right')
    if echo.end not in calibration.ends:
        return _undecodable(echo, f'the {echo.end} end is not read from (read.end is right)')
    if echo.end is End.RIGHT and phases[1] == 1:
        return _undecodable(echo, 'the right end is active: the wall has left the element')
    if echo.spoiled:
        return _undecodable(echo, f'the base began to shake while the {echo.end} end listened')
    what = 'shaking' if echo.shaken else 'noise'
    if echo.delay is None and echo.raised > 1.0:
        return _undecodable(
            echo,
            f'no echo stands out of the {what} at the {echo.end} end, which alone may make v_c '
            f'{echo.floor:.2g} and raises the threshold up to {echo.raised:.2g} times',
        )
    if echo.delay is None:
        return _undecodable(echo, 'no echo came back')
    if echo.raised > MOST_RAISED:
        return _undecodable(
            echo,
            f'the {what} at the {echo.end} end hides when the echo began: it raises the '
            f'threshold {echo.raised:.2g} times, and {MOST_RAISED:g} times is the most that '
            'leaves a delay its level',
        )
    # The phase of the left end tells the two farthest echoes apart, which may be alike: with a
    # kink behind it no wall is at the first defect.
    impossible = BLANK if phases[0] == 1 else 0
    level, margin = calibration.table(echo.end).nearest(echo.delay, impossible)
    if echo.early and margin < 1.0:  # where a level is so near, its calibrated delay is that
        return _undecodable(
            echo,
            f'something is heard at the {echo.end} end when listening begins, at '
            f'{echo.delay:.2f}, and no level is so near',
        )
    least = settings.min_margin
    if echo.shaken:
        least = max(least, settings.shaken_margin)
    if phases[1] == 1:
        return _active(echo, level, margin >= least)
    if margin < least:
        return _undecodable(
            echo, f'the delay {echo.delay:.2f} lies between levels (margin {margin:.2f})'
        )
    if level != BLANK and phases[0] == 0:
        return _undecodable(
            echo,
            f'the left end is inactive, but the delay {echo.delay:.2f} from the right is that '
            f'of a wall at level {level}: there are two walls, or more',
            walls=2,
        )
    code = design.code(level) if level >= 0 else ''
    distance = _distance(design, calibration, echo.end, echo.delay) if level >= 0 else math.inf
    return Reading(
        level,
        code,
        echo.end.value,
        echo.delay,
        margin,
        echo.threshold_margin,
        distance,
        walls=0 if level == BLANK else None,
    )


def combine(design: Design, settings: ReadSettings, left: Reading, right: Reading) -> Reading:
    """Return what the readings from both ends say together.

    One wall is at the same level from either end, and its two distances make up the element.
    Of three walls the left end hears the first and the right end the last.

    Args:
        design: The element.
        settings: Least margin of a decodable level.
        left: Reading of an echo at the left end.
        right: Reading of an echo at the right end.
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
    length = design.N - 1.0
    seen = left.distance + right.distance
    if left.level < right.level:
        return _refused(
            both,
            f'the left end hears a wall at level {left.level} and the right end one at level '
            f'{right.level}: there are three walls, or more',
            walls=3,
        )
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
    """Return a reading of a shaken element if two pulses say the same, else an undecodable one.

    Args:
        reading: What the last pulse says.
        said: The levels that all pulses have said, this one the last.
    """
    if reading.level == UNDECODABLE or reading.level in said[:-1]:
        return reading
    heard = ', '.join(map(describe_level, said))
    return _refused(reading, f'while the base shakes two pulses must say the same: {heard}')


def _active(echo: Echo, level: int, clear: bool) -> Reading:
    """Return what is heard from the left of an element that is active at both ends."""
    reason = 'the right end is active: the wall has left the element'
    if not clear:
        return _undecodable(echo, reason, walls=0)
    return _undecodable(
        echo,
        f'the right end is active, but the left one hears a wall at level {level}: there are '
        'two walls, or more',
        walls=2,
    )


def _distance(design: Design, calibration: Calibration, end: End, delay: float) -> float:
    distances = [end.distance(design, level) for level in range(design.levels)]
    return calibration.table(end).distance(delay, distances)


def _undecodable(echo: Echo, reason: str, walls: int | None = None) -> Reading:
    return Reading(
        UNDECODABLE,
        '',
        echo.end.value,
        echo.delay,
        0.0,
        echo.threshold_margin,
        math.inf,
        reason,
        walls,
    )


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
