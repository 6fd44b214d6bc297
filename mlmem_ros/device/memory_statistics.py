# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The history of a memory: how often, how reliably and how fast it was written."""

from __future__ import annotations

import dataclasses
from dataclasses import MISSING, dataclass
from functools import partial

from ..described import described
from .events import Outcome

_count = partial(described, low=0, high=2**62)


@dataclass
class MemoryStatistics:
    """Counts over the life of an element, saved with its content."""

    level_writes: list[int] = described(MISSING, 'successful writes by level', low=0)
    level_ticks: list[int] = described(MISSING, 'total ticks they took, by level', low=0)
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
