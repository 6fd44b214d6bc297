# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reading one wall by one transducer, which is at the left end; nothing is at the other end.

One end alone cannot tell a wall from a bad cell by what an ideal element does. So a calibration
records what this element does in every content, and a read compares with these records. A cell
that breaks later fits none of them, and the element asks for a new calibration.
"""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING

import numpy as np

from ..errors import Astray, ProcedureFailed, SettingsError
from ..instrument.blocks import Procedure
from ..instrument.end import End
from ..physics import Specimen
from ..physics.potential import Array
from ..rejections import ErrorCode
from ..settings import Settings
from .calibration import Records
from .listening import record_waveforms
from .one_wall import WallForecasts, forecast_levels
from .reading import Reading
from .waveform_reader import WaveformReader
from .waveforms import Ends

if TYPE_CHECKING:
    from ..memory import Memory


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
            SettingsError: The left end does not tell the levels well enough.
        """
        # In elements that scatter, a wall at the last level is often nearer to the forecast of
        # one behind it. Their own records tell them.
        known = copy.copy(forecasts)
        known.tail_parts = departed
        super().__init__(known)
        self.by_forecast = WaveformReader(self.forecasts)
        self._records: Records = ()
        self._tail_parts = np.concatenate((forecasts.tail_parts, departed))
        self._contents = forecasts.contents[: forecasts.content_count + 1]
        levels = forecasts.parts[1 : len(self._contents)]
        apart = np.linalg.norm(levels[:, None] - levels, axis=2) / forecasts.pulse_size
        near = float(apart[np.triu_indices(len(levels), 1)].min(initial=np.inf))
        # Elements with a distance of 0.19 decoded wrong levels with a bad cell, with 0.22 none.
        if near < (least := 0.2):
            raise SettingsError.of_value(
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
            self._contents, parts, tail_parts, late_parts,
            ideal.listener, End.LEFT, max_residual,
        )  # fmt: skip

    def read(self, element: Memory, end: str = '') -> Procedure[Reading]:
        """Read as `WaveformReader.read`; without records, fire no pulse and decode nothing.

        Raises:
            ProcedureFailed: The left end does not become quiet within `read.settle_timeout`.
        """
        if self.needs_calibration(element):
            return element.store_unreadable(
                'the element has no records of its contents: calibrate it first'
            )
        records = element.calibration.records
        if records is not self._records:
            self._records, self.forecasts = records, self._build_forecasts(records)
        reading = yield from super().read(element, end)
        return reading

    def needs_calibration(self, element: Memory) -> bool:
        """Return whether the element has no records of its contents yet."""
        expected = len(self._contents), self.by_forecast.forecasts.parts.shape[1]
        return np.shape(element.calibration.records) != expected

    def record(self, element: Memory) -> Procedure[tuple[Reading, tuple[float, ...]]]:
        """Fire a pulse; return the content whose forecast is nearest, and what the left end does.

        Raises:
            ProcedureFailed: The end rests in neither phase, or does not become quiet.
        """
        forecasts = self.by_forecast.forecasts
        try:
            shot, noise = yield from record_waveforms(element, forecasts)
        except Astray as error:
            raise ProcedureFailed(str(error)) from error
        reading = forecasts.decode(shot, noise, element.phases, 0.0)
        return reading, tuple(map(float, forecasts.listener.project_shot(shot)))


def forecast_records(made: Specimen, settings: Settings) -> tuple[WallForecasts, Array]:
    """Return the arguments of a `RecordReader`.

    Raises:
        SettingsError: The element rubs, or as `forecast_levels`.
    """
    design = made.design
    if design.friction:
        raise SettingsError.of_value(
            ErrorCode.UNSUPPORTED, 'read.method', 'records',
            'waveform for an element with dry friction (design.friction)',
        )  # fmt: skip
    forecasts = forecast_levels(made, settings)
    ends = Ends(made, settings, forecasts.listener)
    return forecasts, ends.compute_answers(made, [np.full(design.N, design.D_s2)])
