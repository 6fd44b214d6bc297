# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An instrument that interprets its echoes: calibration, content, history.

Procedures know nothing else about an element.
"""

from __future__ import annotations

from ..physics import Design
from .calibration import Calibration
from .driver import Driver
from .echo import Echo
from .end import End
from .events import Event, Heard
from .instrument import Instrument
from .memory_statistics import MemoryStatistics
from .reading import Reading, combine, confirmed, decode
from .settings import Settings


class Memory(Instrument):
    """An instrument that reads levels.

    Attributes:
        calibration: Echo delay of every level.
        reading: The last reading; None while the content is unknown.
        statistics: The history of the element.
    """

    def __init__(
        self,
        design: Design,
        settings: Settings,
        calibration: Calibration,
        driver: Driver | None = None,
    ) -> None:
        """Make an instrument, as `Instrument` does, with the echo delay of every level.

        Raises:
            SettingsError: The calibration has a different number of levels.
        """
        calibration.check(design.levels)
        super().__init__(design, settings, driver)
        self.calibration = calibration
        self.reading: Reading | None = None
        self.statistics = MemoryStatistics.of(design.levels)
        self._events: list[Event] = []

    def forget(self) -> None:
        """Treat the content as unknown from now on, because the wall may move."""
        self.reading = None

    def begin_cycle(self) -> None:
        """Count a strain cycle that is about to move the wall."""
        self.statistics.cycles += 1
        self.forget()

    def hear(
        self, echo: Echo, left: Reading | None = None, said: list[int] | None = None
    ) -> Reading:
        """Decode an echo, store the reading and report it.

        Args:
            echo: The echo.
            left: The left end's reading just before, to be combined with an echo at the right end.
            said: The levels read by earlier pulses, to which this one is added: while the base
                shakes, two must agree.
        """
        phases = self.phase(End.LEFT), self.phase(End.RIGHT)
        reading = decode(self.design, self.settings.read, self.calibration, echo, phases)
        if left is not None:
            reading = combine(self.design, self.settings.read, left, reading)
        if said is not None:
            said.append(reading.level)
            if echo.shaken:
                reading = confirmed(reading, said)
        self.reading = reading
        self._events.append(Heard(echo, reading))
        return reading
