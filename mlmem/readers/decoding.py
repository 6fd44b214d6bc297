# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Decoding: from the echoes at the ends to a reading; both ends must detect the same wall.

No error of one end alone turns one level into another, whatever it detects and which of them names
the level: either end by itself must distinguish the level from all others. So where one is wrong,
the other detects its own level and no other, and they disagree. `find_exchanged_levels` proves it
for a calibration.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from statistics import median_low

import numpy as np

from ..instrument.echo import ECHO_TAIL_TIME, Crossings, Echo, earliest_delay
from ..instrument.end import End
from ..physics import Design
from ..physics.values import Array
from ..physics.waves import fastest_speed
from ..procedure_table import BLANK, UNDECODABLE, describe_level
from ..settings import ProbeSettings, ReadSettings, Settings
from .calibration import Calibration
from .reading import Reading, Unclear

MAX_THRESHOLD_FACTOR = 1.4
"""Most by which noise may raise the threshold. Beyond, an echo's slow flank crosses it so late
that the delay may be that of the next level."""

WALL_GONE_REASON = 'the right end is active: the wall has left the element'

Phases = tuple[int | None, int | None]
"""Of the left and the right end; see `Instrument.phase`."""


@dataclass(frozen=True)
class Decoder:
    """Decodes the echoes of one wall.

    Attributes:
        design: The element.
        settings: How to judge an echo.
        calibration: The delays of the levels.
    """

    design: Design
    settings: ReadSettings
    calibration: Calibration

    def decode(self, echoes: Mapping[End, Echo], phases: Phases, end: str = '') -> Reading:
        """Decode the echoes at one end or both, given the phases of the ends.

        A stored level has the active phase at the left end and the inactive one at the right; one
        end names it, and the other must confirm it. A blank element is inactive at both, and its
        far end returns the echo of a probe from the right. If both ends have the same phase and an
        echo comes from within, there are two walls between them.

        `end` is the one whose delay and distance are reported, or both; by default the settings'.
        """
        first = self.settings.primary_end if len(echoes) == 2 else next(iter(echoes))
        end = (end or self.settings.end) if len(echoes) == 2 else first
        shown = echoes[End.RIGHT if end == End.RIGHT else End.LEFT]
        in_order = sorted(echoes.values(), key=lambda echo: echo.end is not first)
        nothing = Reading(
            UNDECODABLE, '', str(end), shown.delay, 0.0,
            min(echo.threshold_margin for echo in in_order), math.inf,
            shapes={echo.end: echo.shape for echo in in_order},
            left_delay=echoes[End.LEFT].delay if End.LEFT in echoes else None,
            right_delay=echoes[End.RIGHT].delay if End.RIGHT in echoes else None,
        )  # fmt: skip
        try:
            level, margin = self._find_level(in_order[0], phases)
            for other in in_order[1:]:
                margin = min(margin, self._confirm_level(level, first, other, phases))
                self._check_amplitude(level, echoes)
        except Unclear as unclear:
            return replace(nothing, reason=str(unclear), walls=unclear.walls)
        if level == BLANK:
            return replace(nothing, level=BLANK, level_margin=margin, walls=0)
        return replace(
            nothing, level=level, code=self.design.code(level), level_margin=margin,
            distance=self._find_distance(shown), walls=1 if len(echoes) == 2 else None,
        )  # fmt: skip

    def _find_distance(self, echo: Echo) -> float:
        """Return the distance in cells of a reflector, by interpolation between the levels."""
        assert echo.delay is not None
        design, delays = self.design, np.array(self.calibration.table(echo.end).delays)
        distances = np.array(
            [echo.end.distance(design, level) for level in range(design.levels)], float
        )
        order = np.argsort(delays)
        return float(np.interp(echo.delay, delays[order], distances[order]))

    def _find_level(self, echo: Echo, phases: Phases) -> tuple[int, float]:
        """Return the level that an echo names, or `BLANK`, and its margin; raises `Unclear`."""
        end, design = echo.end, self.design
        if reason := self._explain_unclear(echo, phases):
            raise Unclear(reason)
        assert echo.delay is not None
        # The two farthest echoes may be alike; the phase of the left end distinguishes them: with
        # a kink behind it there is no wall at the first defect.
        impossible = BLANK if phases[0] == 1 else 0
        level, margin = self.calibration.table(end).find_nearest(echo.delay, impossible)
        if echo.is_early and margin < 1.0:  # unless the calibrated delay of a level is that short
            raise Unclear(
                f'something is heard at the {end} end when listening begins, at '
                f'{echo.delay:.2f}, and no level is so near'
            )
        is_near = margin >= self._min_level_margin(echo)
        if phases[1] == 1 and not is_near:
            raise Unclear(WALL_GONE_REASON, 0)
        if phases[1] == 1:
            raise Unclear(
                f'the right end is active, but the left one hears a wall at level {level}: there '
                'are two walls, or more', 2,
            )  # fmt: skip
        if not is_near:
            cell = end.cell(design, self._find_distance(echo))
            raise Unclear(
                f'the delay {echo.delay:.2f} at the {end} end lies between levels (margin '
                f'{margin:.2f}): what answers is near cell {cell:.0f}'
            )
        if level != BLANK and phases[0] == 0:
            raise Unclear(
                f'the left end is inactive, but the delay {echo.delay:.2f} from the right is that '
                f'of a wall at level {level}: there are two walls, or more, or something else '
                f'answers near cell {design.defect_site(level)}', 2,
            )  # fmt: skip
        return level, margin

    def _min_level_margin(self, echo: Echo) -> float:
        """Return the least level margin at either end. With a strong cell before it, both ends
        detect a wall near the next level, but not as near as a wall there.
        """
        return max(self.settings.min_margin, self.settings.shaken_margin if echo.shaken else 0.0)

    def _explain_unclear(self, echo: Echo, phases: Phases) -> str:
        """Return why an echo has no delay that can be decoded; empty if it has one."""
        end, what = echo.end, 'shaking' if echo.shaken else 'noise'
        if reason := explain_no_phase(phases):
            return reason
        if end is End.LEFT and phases[0] == 0:
            return 'the left end is inactive and hears nothing: probe the right'
        if end is End.RIGHT and phases[1] == 1:
            return WALL_GONE_REASON
        if echo.spoiled:
            return f'the base began to shake while the {end} end listened'
        if echo.delay is None and echo.threshold_factor > 1.0:
            return (
                f'no echo rises above the {what} at the {end} end: that gives a v_c of up to '
                f'{echo.floor:.2g} and raises the threshold up to {echo.threshold_factor:.2g} '
                'times'
            )
        if echo.delay is None:
            return 'no echo came back'
        if echo.threshold_factor > MAX_THRESHOLD_FACTOR:
            return (
                f'the {what} at the {end} end hides when the echo began: it raises the threshold '
                f'{echo.threshold_factor:.2g} times, and a delay is reliable up to '
                f'{MAX_THRESHOLD_FACTOR:g} times'
            )
        return ''

    def _confirm_level(self, level: int, first: End, other: Echo, phases: Phases) -> float:
        """Return the margin with which the echo at the other end confirms what the first named;
        raises `Unclear`.

        Both ends detect a single wall, each from its own side. Whatever else reflects (a stuck or
        damaged cell, a second wall, a pulse that still bounces) does so before the wall, and on
        one side: then the other end does not detect the wall where this one does. What makes both
        ends detect late or early, like weak sensors, moves the two places apart.
        """
        unconfirmed = f'{describe_level(level)} is not confirmed'
        if reason := self._explain_unclear(other, phases):
            raise Unclear(f'{unconfirmed}: {reason}')
        assert other.delay is not None
        low, high, _ = other.shape
        margin, like = self.measure_agreement(
            other.probe, other.end, level, (low, other.delay, high)
        )
        if margin >= self._min_level_margin(other):
            if like is None:
                return margin
            text = f'the {other.end} end does not tell it from {describe_level(like)}'
            raise Unclear(f'{unconfirmed}: {text}')
        other_level, _ = self.calibration.table(other.end).find_nearest(other.delay, BLANK)
        here, there = (self.design.defect_site(n) for n in (level, other_level))
        text = (
            f'the {first} end hears a wall at level {level}, near cell {here}, and the '
            f'{other.end} end one near cell {there}'
        )
        if (here < there) == (other.end is End.RIGHT) and other_level != level:
            text += ': something else answers at one of them, or there are three walls, or more'
            raise Unclear(text, 3)
        raise Unclear(text)

    def _check_amplitude(self, level: int, echoes: Mapping[End, Echo]) -> None:
        """Raise `Unclear` if an echo is much stronger than that of a level; noise adds to both.

        Both are measured up to the same time, `ECHO_TAIL_TIME` after the later echo of that level:
        a faint one may cross late, and grows as one listens on.
        """
        tables = {end: self.calibration.table(end) for end in echoes}
        longest = max(echo.t[-1] for echo in echoes.values())
        later = {end: longest - echo.t[-1] for end, echo in echoes.items()}  # its pulse was fired
        until = max(tables[end].delays[level] + later[end] for end in echoes) + ECHO_TAIL_TIME
        for end, echo in echoes.items():
            if not tables[end].shapes or echo.floor:
                continue
            *_, known = tables[end].shapes[level]
            # Echoes of healthy elements, with disorder too, are within 3 % of the calibrated
            # amplitude. A light cell behind a wall echoes with it, and both ends then report the
            # level before.
            if (ratio := echo.measure_amplitude(until - later[end]) / known) > 1.25:
                raise Unclear(
                    f'the {end} end hears an echo {ratio:.2f} times as loud as that of level '
                    f'{level}: something else answers with the wall'
                )

    def measure_agreement(
        self, probe: ProbeSettings, end: End, level: int, crossings: Crossings | Array
    ) -> tuple[float, int | None]:
        """Return the level margin with which an end detects a wall at a level that the other one
        names, and another level that its echo may as well be of, or None.

        Each crossing, of the threshold and of 0.8 and 1.25 of it, is compared with its own of that
        level; most must agree, so the margin is their median. An echo that begins before listening
        does comes from near this end: it agrees with a level whose own echo does so, and with no
        other. Two levels near this end may both agree; then all crossings say which is nearer.
        """
        table, earliest = self.calibration.table(end), earliest_delay(probe)
        times, known = np.array(crossings, dtype=float), table.crossings[level]
        nearer, other = table.compare_levels(level, crossings, probe)
        # 0 is half-way between two levels: the echo is off by less than 0.45 of their distance,
        # and one taken for the other by at least 0.55
        like = other if nearer < 0.1 else None
        if times[1] <= earliest:
            return (1.0 if known[1] <= earliest else 0.0), like
        fastest = 2.0 * self.design.J / fastest_speed(end.k_s(self.design))
        compared = np.minimum(times, known) > earliest  # not where one does not cross
        compared[1] = True
        offsets = (times - known)[compared].tolist()
        return median_low(table.margin(level, offset, fastest) for offset in offsets), like


def explain_no_phase(phases: Sequence[int | None]) -> str:
    """Return which end rests in neither phase, the left one first; empty if none does."""
    if None not in phases:
        return ''
    return f'the {list(End)[phases.index(None)]} end rests in neither phase'


def find_exchanged_levels(
    design: Design, settings: Settings, calibration: Calibration
) -> list[tuple[End, int, int]]:
    """Return what an error of one end alone does to levels: the erring end, what may be said, and
    the level of the wall; `UNDECODABLE` is said of a level that no echo proves.

    Whatever the erring end detects, the other one detects the wall as calibrated. So it is enough
    that this end by itself accepts its level and no other, whether it names levels or confirms
    them. The list is empty if that is so at every `read.end`.
    """
    found, levels, least = [], range(design.levels), settings.read.min_margin
    decoder = Decoder(design, settings.read, calibration)
    for honest in End:
        table, probe = calibration.table(honest), honest.select_probe(settings)
        for true in levels:
            crossings = table.crossings[true]
            accepted = set()
            for level in levels:
                margin, like = decoder.measure_agreement(probe, honest, level, crossings)
                if margin >= least and like is None:
                    accepted.add(level)
            named, _ = table.find_nearest(table.delays[true], BLANK)
            accepted |= {named} if true in accepted else {named, UNDECODABLE}
            found += [(honest.opposite, level, true) for level in sorted(accepted - {true})]
    return found


def make_undecodable(reading: Reading, reason: str, walls: int | None = None) -> Reading:
    """Return a reading that names no level, for a reason."""
    return replace(
        reading, level=UNDECODABLE, code='', level_margin=0.0, distance=math.inf, reason=reason,
        walls=walls,
    )  # fmt: skip
