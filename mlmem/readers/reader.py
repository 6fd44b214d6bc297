# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a reader is: one way to tell the content of an element by pulses at its ends.

The reader of an element is chosen once, from its settings. The contents of an element belong to
its reader: how many there are, which can be used, and at which levels each has its walls.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from ..errors import SettingsError
from ..instrument.blocks import Procedure
from ..physics import Design, Specimen
from ..rejections import ErrorCode
from ..settings import Settings
from .delay_reader import DelayReader
from .reading import Reading

if TYPE_CHECKING:
    from ..memory import Memory

T = TypeVar('T')


class Reader(Protocol):
    """One way to read an element."""

    @property
    def holds_words(self) -> bool:
        """Whether contents are words of a register, with many walls, rather than levels."""

    @property
    def content_count(self) -> int:
        """How many contents it tells apart, as numbers from 0."""

    @property
    def unusable_reasons(self) -> Mapping[int, str]:
        """Why a content cannot be used, by content; empty if all can."""

    @property
    def limits(self) -> str:
        """Which contents cannot be used and why, in words; empty if no cell is known to be bad."""

    @property
    def single_walls(self) -> Mapping[int, int]:
        """The content with one wall, by level, for every level that can be used."""

    def list_walls(self, content: int) -> tuple[int, ...]:
        """Return the levels at which the walls of a content rest, the lowest first."""

    def read_duration(self, element: Memory) -> float:
        """Return the time units that a read of an element at equilibrium takes."""

    def read(self, element: Memory, end: str = '') -> Procedure[Reading]:
        """Fire its pulses, decode what the ends do, store the reading and return it.

        Args:
            element: The element to read.
            end: The end whose delay is answered: 'left', 'right' or 'both'; empty for the one in
                the settings.

        Raises:
            ProcedureFailed: The element does not come to rest.
        """

    def needs_calibration(self, element: Memory) -> bool:
        """Return whether nothing can be decoded before the element is calibrated."""

    def needs_second_read(self, reading: Reading) -> bool:
        """Return whether a second read may decode what this one, after a move, has not."""


def choose_reader(design: Design, settings: Settings, twin: Specimen | None = None) -> Reader:
    """Return the reader of an element, which forecasts by a twin of it, or by the ideal one.

    Raises:
        SettingsError: Its contents cannot be forecast, or not be told; see `forecast_words`,
            `forecast_bad_cells`, `forecast_levels`, `forecast_records` and `RecordReader`. Or
            cells are known to be bad, which a twin has already.
    """
    if not settings.compares_waveforms:
        return DelayReader(design)
    # most are read by delays
    from .bad_cells import forecast_bad_cells
    from .one_wall import forecast_levels
    from .record_reader import RecordReader, forecast_records
    from .register import forecast_words
    from .waveform_reader import WaveformReader

    def forecast_contents(forecast: Callable[[Specimen, Settings], T]) -> T:
        if twin is not None:
            return forecast(twin, settings)
        found: T = _forecast_ideal(forecast, design, settings)
        return found

    if settings.register.spacing:
        return WaveformReader(forecast_contents(forecast_words))
    if settings.element.bad_cells:
        if twin is not None:
            raise SettingsError.of_value(
                ErrorCode.CONFLICT, 'element.bad_cells', settings.element.bad_cells,
                'empty for a reader that forecasts by a twin',
            )  # fmt: skip
        return WaveformReader(forecast_bad_cells(design, settings))
    if settings.read.method == 'records':
        return RecordReader(*forecast_contents(forecast_records))
    return WaveformReader(forecast_contents(forecast_levels), twin or Specimen(design))


@lru_cache(maxsize=8)
def _forecast_ideal(
    forecast: Callable[[Specimen, Settings], Any], design: Design, settings: Settings
) -> Any:
    return forecast(Specimen(design), settings)
