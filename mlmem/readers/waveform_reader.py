# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reading by waveform: what the ends do after one pulse is compared with the forecast of every
content, or with the record of every content that a calibration has made.

Forecasts read many walls, one wall next to known bad cells, and one wall among strong defects.

Records read one wall by one transducer, which is at the left end; nothing is at the other end. One
end alone cannot distinguish a wall from a bad cell by what an ideal element does. So a calibration
records what this element does in every content, and a read compares with these records. A cell
that breaks later fits none of them, and the element asks for a new calibration.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..commands import Outcome
from ..errors import Astray, ErrorCode, ProcedureFailed, SettingsError
from ..instrument.blocks import Procedure, catch_up
from ..instrument.echo import EchoDetector
from ..physics import Specimen
from ..physics.values import Array
from ..settings import Settings
from .calibration import PulseCorrection, Records
from .decoding import make_undecodable
from .listening import record_waveforms, swinging_time, wait_until_pinned
from .one_wall import WallForecasts, fit_loss_factor, forecast_levels, scale_losses
from .reader import Reader, Writer
from .reading import BLANK, UNDECODABLE, WELL_ERROR_CELLS, Reading, correct_speed, went_too_far
from .register import Forecasts
from .waveforms import Ends

if TYPE_CHECKING:
    from ..memory import Memory


class WaveformReader(Reader):
    """Decodes the content whose forecast is nearest to the record of the ends; see `Reader`.

    Attributes:
        forecasts: What the ends do, by content.
        made: The element of one wall to whose damping and friction a calibration finds a factor;
            None if it finds none.
    """

    def __init__(self, forecasts: Forecasts, made: Specimen | None = None) -> None:
        """Read by these forecasts, which are those of the element as made."""
        walls = {each.number: each.walls for each in forecasts.contents}
        walls.pop(UNDECODABLE, None)  # several walls are none of its contents
        super().__init__(walls, forecasts.lost, forecasts.limits)
        self.forecasts, self.made = forecasts, made
        self._loss_factor = 1.0

    def read_duration(self, element: Memory) -> float:
        """Return the time for which both ends are recorded."""
        pulses = 1 if self.forecasts.hidden_part is None else 2
        return pulses * self.forecasts.listener.ticks * element.tick

    def read(self, element: Memory, end: str = '') -> Procedure[Reading]:
        """Fire the pulse and decode what the ends do; again once a wall that swings has settled.

        Raises:
            ProcedureFailed: The ends do not become quiet within `read.settle_timeout`.
        """
        factor = element.calibration.loss_factor
        if self.made is not None and factor != self._loss_factor:
            self.forecasts = forecast_levels(scale_losses(self.made, factor), element.settings)
            self._loss_factor = factor
        reading = yield from self._read_once(element)
        if reading.level == UNDECODABLE and swinging_time(element) > 0.0:
            yield from wait_until_pinned(element)
            reading = yield from self._read_once(element)
        return reading

    def _read_once(self, element: Memory) -> Procedure[Reading]:
        """Fire the pulse of a read and decode what the ends do.

        What a stuck cell hides from it, a pulse of the right end must confirm.
        """
        forecasts, hidden = self.forecasts, self.forecasts.hidden_part
        settings = element.settings.register
        detector = EchoDetector(settings.probe, element.driver.dt)
        try:
            shot, noise = yield from record_waveforms(element, forecasts)
            row = forecasts.end.row
            detector.feed_displacements(shot.samples[row] - shot.rest[row])
            reading = forecasts.decode(shot, noise, element.phases, settings.min_margin)
            if hidden is not None and reading.level != UNDECODABLE:
                shot, noise = yield from record_waveforms(element, hidden)
                found = hidden.decode(shot, noise, (0, 0), settings.min_margin)
                if found.level != BLANK:
                    why = found.reason or f'the right end hears {found.walls} walls'
                    cell = max(element.settings.element.stuck_sites)
                    reason = f'nothing is known beyond cell {cell}: {why}'
                    reading = make_undecodable(reading, reason, reading.walls)
        except Astray as error:
            return element.store_unreadable(str(error))
        return element.store_reading(reading, [detector.build_echo(forecasts.end)])

    def _needs_second_read(self, reading: Reading) -> bool:
        """Return whether nothing was decoded: waves of the last move are dying away."""
        return reading.level == UNDECODABLE

    def locate(self, element: Memory) -> Procedure[Outcome]:
        """Read the content, and answer where its walls are: at levels, or nowhere.

        Found are `walls`; of one wall its `position` and `position_std` in cells from the left;
        and of a register the `cells` and `kinds` of all, from the left.

        Raises:
            ProcedureFailed: The content cannot be decoded.
        """
        reading = yield from self.read(element)
        if reading.level == UNDECODABLE:
            raise ProcedureFailed(reading.reason)
        sites = [element.design.defect_site(level) for level in self.list_walls(reading.level)]
        found: dict[str, float | str] = {'walls': len(sites)}
        if element.settings.holds_words:
            kinds = ('wall', 'kink') * len(sites)
            found['cells'] = ' '.join(map(str, sites))
            # they alternate from the right
            found['kinds'] = ' '.join(reversed(kinds[: len(sites)]))
        elif sites:
            found |= {'position': float(sites[0]), 'position_std': WELL_ERROR_CELLS}
        return Outcome(reading, found=found)

    def calibrate(self, element: Memory, writer: Writer) -> Procedure[dict[str, Any]]:
        """Write one wall to every level that can be used: each must be read as forecast.

        If kicks write every level, the factor on damping and friction of the design is found
        first, and then one on the speed of every kick, which makes up for it.

        Raises:
            ProcedureFailed: A level was not reached.
        """
        levels = range(element.design.levels)
        found: dict[str, float] = {}
        kicked = all(map(element.settings.is_kicked, levels))
        if kicked and len(levels) > 1 and not element.settings.holds_words:
            found = yield from self._find_factors(element, writer)
        for each in self.single_walls.values():
            yield from writer.write(element, each)
        return {'found': found}

    def _find_factors(self, element: Memory, writer: Writer) -> Procedure[dict[str, float]]:
        """Find and set the factors on losses and on the speeds of kicks; return them by name.

        That on damping and friction follows from the answer of the blank element. No reading tells
        that it is blank, because a reader needs this factor; the ends do.
        """
        found, attempts = {}, element.settings.write.attempts
        if self.made is not None:
            for attempt in range(1 + attempts):
                if attempt:
                    yield from writer.kick_out(element)
                yield from catch_up(element)
                if element.phases == (0, 0):
                    break
            else:
                raise ProcedureFailed(f'the element is not blank after {attempts} kicks')
            shot, _ = yield from record_waveforms(element, self.forecasts)
            factor = fit_loss_factor(self.made, element.settings, self.forecasts, shot)
            element.calibration = replace(element.calibration, loss_factor=factor)
            found['loss_factor'] = factor
        return found | {'kick_factor': (yield from self._find_kick_factors(element, writer))}

    def _find_kick_factors(self, element: Memory, writer: Writer) -> Procedure[float]:
        """Find and set a factor on the speed of the kick to every level, the middle of those that
        take the wall there; return their geometric mean.

        A level that is not reached has the mean factor. The last level is only tried if the right
        end can kick back a wall that left the element.
        """
        levels, least, found = element.design.levels, element.settings.write.min_margin, {}
        # slow kicks need less than the factor on the losses, fast ones more
        factors = [element.calibration.loss_factor * 1.04**power for power in range(-9, 6)]
        last = levels - 1 if element.settings.has_one_transducer else levels
        for level in [level for level in self.single_walls if level < last]:
            good = []
            # They rise until the wall goes too far: one that runs against what is behind the last
            # level comes back, and what is read then means nothing.
            for factor in factors:
                element.correct_pulses([PulseCorrection(speed=factor)] * levels)
                yield from writer.go_to_level(element, UNDECODABLE, level)
                reading = yield from self.read(element)
                if went_too_far(element, reading, level):
                    break
                if reading.level == level and reading.level_margin >= least:
                    good.append(factor)
            if good:
                found[level] = round(math.sqrt(good[0] * good[-1]), 6)
        if not found:
            raise ProcedureFailed(
                f'no factor from {factors[0]:.2f} to {factors[-1]:.2f} on the speeds of kicks '
                'reaches any level'
            )
        mean = round(math.exp(math.fsum(map(math.log, found.values())) / len(found)), 6)
        corrections = [PulseCorrection(speed=found.get(level, mean)) for level in range(levels)]
        element.correct_pulses(corrections)
        return mean


class RecordReader(WaveformReader):
    """Decodes the content whose record is nearest to what the left end does; see `Reader`.

    Attributes:
        by_forecast: The reader by which a calibration finds the levels.
    """

    def __init__(self, forecasts: WallForecasts, departed: Array) -> None:
        """Read by the records of the element; these forecasts only serve its calibration.

        Args:
            forecasts: Of all contents, and of walls behind the last level.
            departed: The forecast of an element whose wall has left it, shape (1, 2 lines).

        Raises:
            SettingsError: The left end does not distinguish the levels well enough.
        """
        # In elements that scatter, a wall at the last level is often nearer to the forecast of
        # one behind it. Their own records distinguish them.
        super().__init__(replace(forecasts, tail_parts=departed))
        self.by_forecast = WaveformReader(self.forecasts)
        self._records: Records = ()
        self._tail_parts = np.concatenate((forecasts.tail_parts, departed))
        self._contents = forecasts.contents[: self.content_count + 1]
        levels = forecasts.parts[1 : len(self._contents)]
        apart = np.linalg.norm(levels[:, None] - levels, axis=2) / forecasts.pulse_size
        near = float(apart[np.triu_indices(len(levels), 1)].min(initial=np.inf))
        # Elements with a distance of 0.19 decoded wrong levels with a bad cell, with 0.22 none.
        if near < (least := 0.2):
            raise SettingsError(
                ErrorCode.UNSUPPORTED, 'read.method', 'records',
                'delay or waveform for this element: at its left end the answers of two levels '
                f'differ by {near:.2f} of the pulse, and one end alone needs {least}',
            )  # fmt: skip

    def _build_forecasts(self, records: Records) -> WallForecasts:
        """Return forecasts that are the records. A wall behind the last level differs from one at
        that level as it does in the ideal element.
        """
        ideal, parts = self.by_forecast.forecasts, np.array(records)
        last = len(parts) - 1
        tail_parts = self._tail_parts + (parts[last] - ideal.parts[last])
        max_residual = 0.06  # of the nearest record, relative to the response of a blank element
        late_parts = parts[None, :0]  # a late record is seven times the limit from any other
        return WallForecasts(
            self._contents, parts, ideal.listener,
            tail_parts=tail_parts, late_parts=late_parts, max_residual=max_residual,
        )  # fmt: skip

    def read(self, element: Memory, end: str = '') -> Procedure[Reading]:
        """Read as `WaveformReader.read`; without records, fire no pulse and decode nothing."""
        if self.needs_calibration(element):
            return element.store_unreadable(
                'the element has no records of its contents: calibrate it first'
            )
        records = element.calibration.records
        if records is not self._records:
            self._records, self.forecasts = records, self._build_forecasts(records)
        return (yield from super().read(element, end))

    def needs_calibration(self, element: Memory) -> bool:
        """Return whether the element has no records of its contents yet."""
        expected = len(self._contents), self.by_forecast.forecasts.parts.shape[1]
        return np.shape(element.calibration.records) != expected

    def calibrate(self, element: Memory, writer: Writer) -> Procedure[dict[str, Any]]:
        """Find the factor on the speeds of kicks, and record the blank element and every level.

        Every record must be nearest to the forecast of its own content.

        Raises:
            ProcedureFailed: A level was not reached.
        """
        element.reader = self.by_forecast
        try:
            factors = yield from self.by_forecast._find_factors(element, writer)
            records = []
            for content in (BLANK, *self.single_walls.values()):
                records.append((yield from self._record_content(element, writer, content)))
            element.calibration = replace(element.calibration, records=tuple(records))
        finally:
            element.reader = self
        return {'found': factors}

    def _record_content(
        self, element: Memory, writer: Writer, content: int
    ) -> Procedure[tuple[float, ...]]:
        """Write a content from blank, and record it once its wall has settled."""
        forecasts = self.by_forecast.forecasts
        attempts, nudge, seen = element.settings.write.attempts, 1.0, []
        for attempt in range(1, attempts + 1):
            yield from writer.go_to_level(element, UNDECODABLE, content, nudge=nudge)
            yield from wait_until_pinned(element)
            shot, noise = yield from record_waveforms(element, forecasts)
            reading = forecasts.decode(shot, noise, element.phases, 0.0)
            if reading.level == content:
                return tuple(map(float, forecasts.listener.project_shot(shot)))
            nudge *= correct_speed(element, reading, content, attempt)
            seen.append(reading.reason or element.describe_content(reading.level))
        raise ProcedureFailed(
            f'{element.describe_content(content)} was not recorded in {attempts} attempts; heard '
            f'instead: {", ".join(seen)}',
        )


def forecast_records(made: Specimen, settings: Settings) -> tuple[WallForecasts, Array]:
    """Return the arguments of a `RecordReader`.

    Raises:
        SettingsError: The element rubs, or as `forecast_levels`.
    """
    design = made.design
    if design.friction:
        raise SettingsError(
            ErrorCode.UNSUPPORTED, 'read.method', 'records',
            'waveform for an element with dry friction (design.friction)',
        )  # fmt: skip
    forecasts = forecast_levels(made, settings)
    ends = Ends(made, settings, forecasts.listener)
    return forecasts, ends.compute_answers(made, [np.full(design.N, design.D_s2)])
