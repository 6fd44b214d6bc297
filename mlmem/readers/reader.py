# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a reader is: one way to find the content of an element by pulses at its ends.

The reader of an element is chosen once, from its settings. The contents of an element belong to
its reader: how many there are, which can be used, and at which levels each has its walls. So do
calibrating the element and locating its walls.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

from ..commands import Outcome
from ..errors import ErrorCode, ProcedureFailed, SettingsError
from ..instrument.blocks import Procedure
from ..physics import Design, Specimen, StateError, as_specimen
from ..settings import Settings
from .listening import swinging_time, wait_until_pinned
from .reading import UNDECODABLE, Reading

if TYPE_CHECKING:
    from ..memory import Memory
    from .bad_cells import BadCells


class Writer(NamedTuple):
    """What takes the walls of an element somewhere during a calibration; see `procedures`.

    Attributes:
        write: Writes a content, and verifies it.
        erase: Makes the element blank, and reads it.
        go_to_level: Drives the walls from a content to another, and reads nothing.
        kick_out: Kicks the wall out, and reads nothing.
    """

    write: Callable[[Memory, int], Procedure[Outcome]]
    erase: Callable[[Memory], Procedure[Outcome]]
    go_to_level: Callable[..., Procedure[None]]
    kick_out: Callable[[Memory], Procedure[None]]


class Reader(ABC):
    """One way to read an element.

    Attributes:
        unusable_reasons: Why a content cannot be used, by content; empty if all can.
        limits: The same in words; empty if no cell is known to be bad.
        content_count: How many contents it distinguishes, as numbers from 0.
        single_walls: The content with one wall, by level, for every level that can be used.
    """

    def __init__(
        self,
        walls: Mapping[int, tuple[int, ...]],
        unusable_reasons: Mapping[int, str] | None = None,
        limits: str = '',
    ) -> None:
        self._walls, self.limits = walls, limits
        self.unusable_reasons = unusable_reasons or {}
        self.content_count = 1 + max((*walls, *self.unusable_reasons))
        self.single_walls = {
            levels[0]: content
            for content, levels in walls.items()
            if len(levels) == 1 and content >= 0 and content not in self.unusable_reasons
        }

    def list_walls(self, content: int) -> tuple[int, ...]:
        """Return the levels at which the walls of a content rest, the lowest first.

        Raises:
            StateError: There is no such content.
        """
        if content not in self._walls:
            known = f'from {min(self._walls)} to {max(self._walls)}'
            raise StateError.out_of_range('content', content, known)
        return self._walls[content]

    @abstractmethod
    def read_duration(self, element: Memory) -> float:
        """Return the time units that a read of an element at equilibrium takes."""

    @abstractmethod
    def read(self, element: Memory, end: str = '') -> Procedure[Reading]:
        """Fire its pulses, decode what the ends do, store the reading and return it.

        `end` is the one whose delay is answered; see `Read`.

        Raises:
            ProcedureFailed: The element does not come to rest.
        """

    def read_settled(self, element: Memory, end: str = '') -> Procedure[Reading]:
        """Read; if a wall that still swings gave no content, read again once it has settled.

        The echo of a wall that swings after a strain or a kick is too strong, too early or too
        late.
        """
        reading = yield from self.read(element, end)
        answers = reading.left_delay is not None or reading.right_delay is not None
        if answers and reading.level == UNDECODABLE and swinging_time(element) > 0.0:
            yield from wait_until_pinned(element)
            reading = yield from self.read(element, end)
        return reading

    def report_content(self, element: Memory, end: str = '') -> Procedure[Outcome]:
        """Read the content (see `read_settled`), and answer with the delay at one end.

        Raises:
            ProcedureFailed: It cannot be decoded, or the element does not come to rest.
        """
        reading = yield from self.read_settled(element, end)
        if reading.level == UNDECODABLE:
            raise ProcedureFailed(reading.reason)
        return Outcome(reading)

    def read_after_move(self, element: Memory) -> Procedure[Reading]:
        """Read; once more if that may decode what this one has not, so soon after a move."""
        reading = yield from self.read(element)
        if self._needs_second_read(reading):
            reading = yield from self.read(element)
        return reading

    @abstractmethod
    def _needs_second_read(self, reading: Reading) -> bool:
        """Return whether a second read may decode what this one, after a move, has not."""

    def needs_calibration(self, element: Memory) -> bool:
        """Return whether nothing can be decoded before the element is calibrated."""
        return False

    @abstractmethod
    def calibrate(self, element: Memory, writer: Writer) -> Procedure[dict[str, Any]]:
        """Take the walls through the levels and set the element's calibration.

        Returns:
            Fields of the outcome.

        Raises:
            ProcedureFailed: A level was not reached.
        """

    @abstractmethod
    def locate(self, element: Memory) -> Procedure[Outcome]:
        """Find the walls, between levels too if the reader can.

        Raises:
            ProcedureFailed: The walls cannot be located.
        """


def choose_reader(
    design: Design,
    settings: Settings,
    twin: Specimen | None = None,
    bad_cells: BadCells | None = None,
) -> Reader:
    """Return the reader of an element, which forecasts by a twin of it, or by the ideal one; if
    cells are known to be bad, by the rehearsed forecasts `bad_cells`.

    Raises:
        SettingsError: Its contents cannot be forecast, or not be distinguished; see
            `forecast_words`, `forecast_bad_cells`, `forecast_levels`, `forecast_records` and
            `RecordReader`. Or cells are known to be bad, which a twin has already.
    """
    if not settings.compares_waveforms:
        from .delay_reader import DelayReader

        return DelayReader(design)
    # most are read by delays
    from .bad_cells import forecast_bad_cells
    from .one_wall import forecast_levels
    from .register import forecast_words
    from .waveform_reader import RecordReader, WaveformReader, forecast_records

    material = twin or design
    # a twin lives no longer than what reads by it
    forecast_contents = _forecast_contents if twin is None else _forecast_contents.__wrapped__
    if settings.holds_words:
        return WaveformReader(forecast_contents(forecast_words, material, settings))
    if settings.element.bad_cells:
        if twin is not None:
            raise SettingsError(
                ErrorCode.CONFLICT, 'element.bad_cells', settings.element.bad_cells,
                'empty for a reader that forecasts by a twin',
            )  # fmt: skip
        return WaveformReader(bad_cells or forecast_bad_cells(design, settings))
    if settings.read.method == 'records':
        return RecordReader(*forecast_contents(forecast_records, material, settings))
    forecasts = forecast_contents(forecast_levels, material, settings)
    return WaveformReader(forecasts, as_specimen(material))


@lru_cache(maxsize=8)
def _forecast_contents(
    forecast: Callable[[Specimen, Settings], Any], material: Design | Specimen, settings: Settings
) -> Any:
    return forecast(as_specimen(material), settings)
