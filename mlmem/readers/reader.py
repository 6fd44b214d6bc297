# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a reader is: one way to tell the content of an element by pulses at its ends.

The reader of an element is chosen once, from its settings. The contents of an element belong to
its reader: how many there are, which can be used, and at which levels each has its walls.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Protocol

from ..instrument.blocks import Procedure
from ..physics import Design, Specimen
from ..settings import Settings
from .reading import Reading

if TYPE_CHECKING:
    from ..memory import Memory


class Reader(Protocol):
    """One way to read an element."""

    @property
    def holds_words(self) -> bool:
        """Whether contents are words of a register, with many walls, rather than levels."""

    @property
    def content_count(self) -> int:
        """How many contents it tells apart, as numbers from 0."""

    @property
    def lost(self) -> Mapping[int, str]:
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

    def adopt(self, twin: Specimen, settings: Settings) -> Reader:
        """Return a reader that forecasts what the ends do by a twin.

        Raises:
            SettingsError: The twin does not hold every content.
        """


def choose_reader(design: Design, settings: Settings) -> Reader:
    """Return the reader of an element, with the forecasts of an ideal one.

    Raises:
        SettingsError: Its contents cannot be forecast, or not be told; see `forecast_words`,
            `forecast_bad_cells`, `forecast_levels`, `forecast_records` and `RecordReader`.
    """
    if not settings.compares_waveforms:
        from .delay_reader import DelayReader

        return DelayReader(design)
    if settings.read.method == 'records':
        from .record_reader import RecordReader, forecast_ideal_records  # few are read by them

        return RecordReader(*forecast_ideal_records(design, settings))
    from .waveform_reader import read_ideal  # most are read by delays

    return read_ideal(design, settings)
