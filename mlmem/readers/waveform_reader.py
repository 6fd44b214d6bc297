# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reading by waveform: what the ends do after one pulse is compared with the forecast of every
content.

This reads many walls, one wall next to known bad cells, and one wall among strong defects.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from ..errors import Astray
from ..instrument.blocks import Procedure
from ..instrument.echo import EchoDetector
from ..instrument.end import End, Shot
from ..physics import Specimen
from ..settings import Settings
from .listening import record_waveforms, swinging_time, wait_until_pinned
from .one_wall import fit_loss_factor, forecast_levels, scale_losses
from .reading import UNDECODABLE, Reading
from .register import Forecasts

if TYPE_CHECKING:
    from ..memory import Memory


class WaveformReader:
    """Decodes the content whose forecast is nearest to the record of the ends; see `Reader`.

    Attributes:
        forecasts: What the ends do, by content.
        made: The element of one wall to whose damping and friction a calibration finds a factor;
            None if it finds none.
    """

    def __init__(self, forecasts: Forecasts, made: Specimen | None = None) -> None:
        """Read by these forecasts, which are those of the element as made."""
        self.forecasts, self.made = forecasts, made
        self._loss_factor = 1.0

    @property
    def holds_words(self) -> bool:
        """Whether the forecasts are those of a register."""
        return self.forecasts.holds_words

    @property
    def content_count(self) -> int:
        """How many contents the forecasts tell apart, as numbers from 0."""
        return self.forecasts.content_count

    @property
    def unusable_reasons(self) -> Mapping[int, str]:
        """Why a content cannot be used, by content: because of a known bad cell."""
        return self.forecasts.lost

    @property
    def limits(self) -> str:
        """Which contents cannot be used and why, in words."""
        return self.forecasts.describe_limits()

    @property
    def single_walls(self) -> Mapping[int, int]:
        """The content with one wall, by level, for every level that can be used."""
        return {
            walls[0]: number
            for number, walls, _ in self.forecasts.contents
            if len(walls) == 1 and number >= 0 and number not in self.unusable_reasons
        }

    def list_walls(self, content: int) -> tuple[int, ...]:
        """Return the levels at which the walls of a content rest, the lowest first."""
        return self.forecasts.find_content(content).walls

    def read_duration(self, element: Memory) -> float:
        """Return the time for which both ends are recorded."""
        pulses = 1 if self.forecasts.hidden_part is None else 2
        return pulses * self.forecasts.listener.ticks * element.tick

    def read(self, element: Memory, end: str = '') -> Procedure[Reading]:
        """Fire the pulse and decode what the ends do; again once a wall that swings has settled.

        Raises:
            ProcedureFailed: The ends do not become quiet within `read.settle_timeout`.
        """
        self.scale_losses(element.calibration.loss_factor, element.settings)
        reading = yield from self._read_once(element)
        if reading.level == UNDECODABLE and swinging_time(element) > 0.0:
            yield from wait_until_pinned(element)
            reading = yield from self._read_once(element)
        return reading

    def fit_losses(self, shot: Shot, settings: Settings) -> float:
        """Return the factor on damping and friction of the element as made with which the blank
        element would answer a pulse as it did; needs `made`.
        """
        assert self.made is not None
        listener, end = self.forecasts.listener, self.forecasts.end
        return fit_loss_factor(self.made, settings, listener, end, listener.project_shot(shot))

    def scale_losses(self, factor: float, settings: Settings) -> None:
        """Forecast with the damping and friction that a calibration found."""
        if self.made is not None and factor != self._loss_factor:
            self.forecasts = forecast_levels(scale_losses(self.made, factor), settings)
            self._loss_factor = factor

    def _read_once(self, element: Memory) -> Procedure[Reading]:
        """Fire the pulse of a read and decode what the ends do.

        What a stuck cell hides from it, a pulse of the right end must confirm.
        """
        forecasts, hidden = self.forecasts, self.forecasts.hidden_part
        settings = element.settings.register
        detector = EchoDetector(settings.probe, element.driver.dt)
        try:
            shot, noise = yield from record_waveforms(element, forecasts, forecasts.end)
            row = forecasts.end.row
            detector.feed_displacements(shot.samples[row] - shot.rest[row])
            reading = forecasts.decode(shot, noise, element.phases, settings.min_margin)
            if hidden is not None and reading.level != UNDECODABLE:
                shot, noise = yield from record_waveforms(element, hidden, End.RIGHT)
                reading = hidden.confirm_reading(reading, shot, noise, settings.min_margin)
        except Astray as error:
            return element.store_unreadable(str(error))
        return element.store_reading(reading, [detector.build_echo(forecasts.end)])

    def needs_calibration(self, element: Memory) -> bool:
        """Return False: forecasts serve."""
        return False

    def needs_second_read(self, reading: Reading) -> bool:
        """Return whether nothing was decoded: waves of the last move are dying away."""
        return reading.level == UNDECODABLE
