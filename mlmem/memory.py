# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An instrument that interprets its echoes: calibration, content, and its history: how often, how
reliably and how fast it was written.

Procedures know nothing else about an element.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from .commands import EchoReceived, Event, Outcome
from .errors import ErrorCode, SettingsError
from .instrument.actuator import TransmissionState
from .instrument.drivers import Driver
from .instrument.echo import Echo
from .instrument.end import End, Shot
from .instrument.instrument import Instrument
from .instrument.transducer import UNLIMITED_SAMPLES
from .physics import Design, Specimen, find_walls, stable_step
from .physics.energy import energy
from .physics.equilibrium import make_blank
from .physics.values import Array
from .procedure_table import CONTENT_NAMES, describe_content
from .readers.calibration import Calibration, PulseCorrection, make_corrections
from .readers.decoding import make_undecodable
from .readers.reader import choose_reader
from .readers.reading import BLANK, UNDECODABLE, Reading, Unknown
from .schema import describe_field
from .settings import Settings

if TYPE_CHECKING:
    from .readers.bad_cells import BadCells

_count = partial(describe_field, low=0, high=2**62)


@dataclass
class MemoryStatistics:
    """Counts over the life of an element, saved with its content."""

    level_writes: list[int] = describe_field(MISSING, 'successful writes by level', low=0)
    level_ticks: list[int] = describe_field(MISSING, 'total ticks they took, by level', low=0)
    writes: int = _count(0, 'writes that were not aborted')
    first_try: int = _count(0, 'of these, those that succeeded at the first attempt')
    retries: int = _count(0, 'attempts beyond the first')
    failures: int = _count(0, 'writes that did not reach their level')
    erases: int = _count(0, 'erases that were not aborted')
    reads: int = _count(0, 'reads that were not aborted')
    undecodable: int = _count(0, 'of these, those that decoded nothing')
    aborted: int = _count(0, 'procedures ended by an abort')
    cycles: int = _count(0, 'strain cycles of all procedures, launches too: they wear an element')
    resets: int = _count(0, 'how often it was replaced by a fresh one')

    def count(self, outcome: Outcome) -> None:
        """Count the outcome of a procedure that was not aborted."""
        match outcome.procedure:
            case 'write':
                self._count_write(outcome)
            case 'read':
                self.reads += 1
                self.undecodable += not outcome.success
            case 'erase':
                self.erases += 1

    def _count_write(self, outcome: Outcome) -> None:
        self.writes += 1
        self.retries += outcome.attempts - 1
        if not outcome.success or outcome.reading is None:
            self.failures += 1
            return
        self.first_try += outcome.attempts == 1
        level = outcome.reading.level
        self.level_writes[level] += 1
        self.level_ticks[level] += outcome.end_tick - outcome.start_tick

    @property
    def mean_ticks(self) -> dict[int, float]:
        """Mean ticks of a write, by level; levels never written have none."""
        totals = enumerate(zip(self.level_writes, self.level_ticks, strict=True))
        return {level: ticks / count for level, (count, ticks) in totals if count}


class Memory(Instrument):
    """An instrument that reads levels.

    Attributes:
        forecast: What a twin forecasts of a calibration, which `calibrate` verifies, or None.
        reader: How the content is read; chosen from the settings.
        twin: The element by which the reader forecasts; None: the ideal one.
        reading: The last reading; None while the content is unknown.
        unknown: Why and since when it is, if it was known before.
        loudest: The loudest pulse that moves nothing, in cells, by end, where that is known.
    """

    def __init__(
        self,
        design: Design,
        settings: Settings,
        calibration: Calibration,
        driver: Driver | None = None,
        bad_cells: BadCells | None = None,
    ) -> None:
        """Make an instrument, as `Instrument` does, with the echo delay of every level, and with
        rehearsed forecasts if cells are known to be bad.

        Raises:
            SettingsError: The calibration has a different number of levels.
        """
        calibration.check(design.levels, settings.read.primary_end)
        super().__init__(design, settings, driver)
        self.calibration = calibration
        self.forecast: Calibration | None = None
        self.reading: Reading | None = None
        self.unknown: Unknown | None = None
        self.loudest: Mapping[End, float] = {}
        self.reader = choose_reader(design, settings, bad_cells=bad_cells)
        self.twin: Specimen | None = None
        never = [0] * self.reader.content_count
        self.statistics = MemoryStatistics(never.copy(), never.copy())
        self._events: list[Event] = []

    @property
    def pulse_corrections(self) -> list[PulseCorrection]:
        """Corrections by the level to which a pulse takes the wall."""
        return self.calibration.corrections_by_level(self.settings)

    def correct_pulses(self, corrections: Iterable[PulseCorrection]) -> None:
        """Correct the pulses of the settings from now on, by the level to which they lead."""
        known = make_corrections(corrections, self.settings)
        self.calibration = replace(self.calibration, pulse_corrections=known)

    def adopt_twin(self, twin: Specimen) -> None:
        """Let the reader forecast by a twin.

        Raises:
            SettingsError: It has other cells or defects than the design, or as `choose_reader`.
        """
        if not (isinstance(twin, Specimen) and twin.design.cells == self.design.cells):
            expected = f'a specimen with N, J, J_s, tail = {self.design.cells}'
            raise SettingsError(ErrorCode.CONFLICT, 'twin', twin, expected)
        self.reader = choose_reader(self.design, self.settings, twin)
        self.twin = twin

    @property
    def content_name(self) -> str:
        """What its content is called: `level` of one wall, or `word` of a register."""
        return CONTENT_NAMES[self.settings.holds_words]

    def describe_content(self, content: int) -> str:
        """Return a content in words: a word of a register, or a level."""
        return describe_content(self.content_name, content)

    @property
    def walls(self) -> Array:
        """True positions of all walls of a simulated element in cells, from left to right.

        Raises:
            Refused: The element is real.
        """
        found = find_walls(self.design, self.chain.configuration)
        return np.array([wall.position for wall in found])

    @property
    def material(self) -> Mapping[str, Any]:
        """How a simulated element is: `dt` in time units, number of walls, energies in
        k_r cells^2; of a real one, the health of its driver.
        """
        if (chain := self.driver.chain) is None:
            return self.driver.health()
        energies = energy(chain)
        return {
            'stability_margin': 1.0 - chain.dt / stable_step(chain.specimen),
            'dt': chain.dt,
            'walls': len(self.walls),
            'kinetic_energy': energies.kinetic,
            'stored_energy': energies.total - energies.kinetic,
        }

    def forget_content(self, reason: str, after: int = 0) -> None:
        """Treat the content as unknown, after so many ticks, because the wall may move.

        What is unknown already is so for its first reason.
        """
        if self.reading is not None:
            self.reading, self.unknown = None, Unknown(reason, self.ticks + after)

    def place_content(self, content: int) -> None:
        """Put the walls of a level or word into a simulated element, at rest, without a reading.

        Raises:
            StateError: The walls do not rest there; nothing is changed.
        """
        self.chain.place(self._pin_content(content))
        self.transducer.assume_equilibrium()

    def _pin_content(self, content: int) -> Array:
        from .readers.register import pin_walls  # most elements begin as they are

        return pin_walls(self.made, self.reader.list_walls(content))

    def replace_element(self, content: int = BLANK) -> None:
        """Put a fresh element, unstrained and at rest, blank or with a content, in the place of a
        simulated one.

        Raises:
            Refused: The element is real.
            StateError: The walls of the content do not rest there; nothing is changed.
        """
        blank = content == BLANK
        self.chain.place(make_blank(self.made) if blank else self._pin_content(content))
        self.actuator.hold(0.0)
        self.transmission.state = TransmissionState()
        self.transducer.release_ends()
        self.transducer.assume_equilibrium()
        self.last_moved = -UNLIMITED_SAMPLES
        self.statistics.resets += 1
        self.forget_content('replaced')

    def report_shot(self, shot: Shot) -> None:
        """Report a shot of a survey."""
        self._events.append(shot)

    def begin_cycle(self, how: str = 'strained') -> None:
        """Count a cycle of strain, a kick or a clearing pulse that is about to move the wall."""
        self.statistics.cycles += 1
        self.forget_content(f'{how} by a procedure')

    def passage_time(self, end: End) -> float:
        """Return in which time a pulse of an end comes back from the farthest reflector."""
        # an element may be a tenth slower than its calibration
        return 1.1 * self.calibration.table(end).longest_delay

    def store_reading(self, reading: Reading, echoes: Iterable[Echo] = ()) -> Reading:
        """Store what was read, which is undecodable if the wall may have moved since the pulse;
        report it with its echoes, and return it.
        """
        if self.transducer.shaken and reading.level != UNDECODABLE:
            reading = make_undecodable(
                reading,
                'the base shook by more than disturbance.safe_limit: the wall may have moved '
                'since the pulse',
            )
        self.reading, self.unknown = reading, None
        self._events += [EchoReceived(echo, reading) for echo in echoes]
        return reading

    def store_unreadable(self, reason: str) -> Reading:
        """Store why no pulse was fired."""
        return self.store_reading(
            Reading(UNDECODABLE, '', End.LEFT.value, None, 0.0, 0.0, math.inf, reason)
        )
