# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The history of a memory: how often, how reliably and how fast it was written."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..clipped import clipped
from .events import Outcome


@dataclass
class MemoryStatistics:
    """Counts over the life of an element, saved with its content.

    Attributes:
        level_writes: Successful writes by level.
        level_ticks: Total ticks they took, by level.
        writes: Writes that were not aborted.
        first_try: Of these, those that succeeded at the first attempt.
        retries: Attempts beyond the first.
        failures: Writes that did not reach their level.
        erases: Erases that were not aborted.
        reads: Reads that were not aborted.
        undecodable: Of these, those that decoded nothing.
        aborted: Procedures ended by an abort.
        cycles: Strain cycles of all procedures, including launches: they wear an element.
        resets: How often it was replaced by a fresh one.
    """

    level_writes: list[int]
    level_ticks: list[int]
    writes: int = 0
    first_try: int = 0
    retries: int = 0
    failures: int = 0
    erases: int = 0
    reads: int = 0
    undecodable: int = 0
    aborted: int = 0
    cycles: int = 0
    resets: int = 0

    @classmethod
    def of(cls, levels: int) -> MemoryStatistics:
        """Return the statistics of a new element."""
        return cls([0] * levels, [0] * levels)

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

    def as_dict(self) -> dict[str, float]:
        """Return flat values for diagnostics: the counts, and the mean ticks of a write by level.

        Levels never written have no mean.
        """
        values: dict[str, float] = {
            name: count
            for name, count in dataclasses.asdict(self).items()
            if not name.startswith('level_')
        }
        for level, count in enumerate(self.level_writes):
            if count:
                values[f'mean_ticks_{level}'] = self.level_ticks[level] / count
        return values

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], levels: int) -> MemoryStatistics:
        """Return the statistics that `dataclasses.asdict` gave.

        Raises:
            TypeError: A count is unknown or missing.
            ValueError: A count is not a whole number from 0, or the number of levels differs.
        """
        copied: dict[str, Any] = {
            name: value[:] if isinstance(value, list) else value for name, value in data.items()
        }
        found = cls(**copied)
        single = dict(vars(found))
        by_level = [single.pop(name) for name in ('level_writes', 'level_ticks')]
        if any(not isinstance(each, list) or len(each) != levels for each in by_level):
            raise ValueError(f'the statistics must be for {levels} levels')
        for count in (*single.values(), *itertools.chain(*by_level)):
            if isinstance(count, bool) or not isinstance(count, int) or count < 0:
                raise ValueError(f'a count must be a whole number from 0; got {clipped(count)}')
        return found
