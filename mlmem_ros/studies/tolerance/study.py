# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The study: kinds of scatter by amount, each counted until enough has failed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...device import Settings
from ...physics import Design
from ..campaign import Campaign, Ledger, Row, run
from .estimate import ENOUGH, Rate, rare_scatter
from .point import BATCH, common, evaluate
from .trial import ENDS

SPANS = {
    'alpha': (5e-4, 2e-2),
    's': (2e-2, 3e-1),
    'mass': (1e-3, 3e-2),
    'offset': (5e-4, 2e-2),
    'noise': (3e-6, 1e-3),
    'vibration': (1e-5, 3e-3),
}
"""Least and greatest scatter by kind: from where hardly anything fails to where much does."""

FAILURES = ('step', *ENDS)
"""What can fail: a step of a write, and a read from either end."""


@dataclass(frozen=True)
class Tolerance:
    """A study of what an element stands of chance: in its fabrication, its sensors, its base.

    Attributes:
        design: The element.
        settings: The instrument's.
        kinds: What chance decides, one at a time.
        amounts: How many amounts of each, evenly spaced in the logarithm.
        most: Elements of an amount after which counting stops, however few have failed.
        seed: Of everything.
    """

    design: Design
    settings: Settings
    kinds: tuple[str, ...] = tuple(SPANS)
    amounts: int = 8
    most: int = 300
    seed: int = 0

    def __post_init__(self) -> None:
        if unknown := sorted(set(self.kinds) - set(SPANS)):
            raise ValueError(f'kinds must be of {", ".join(SPANS)}; got {", ".join(unknown)}')
        if self.amounts < 2 or self.most < 1:
            raise ValueError(
                f'amounts must be at least 2 and most at least 1; got {self.amounts}, {self.most}'
            )

    @cached_property
    def cells(self) -> list[tuple[str, float]]:
        """The kinds and amounts that are counted."""
        return [
            (kind, float(f'{amount:.3g}'))
            for kind in self.kinds
            for amount in np.geomspace(*SPANS[kind], self.amounts)
        ]

    @property
    def rounds(self) -> int:
        """Batches of an amount, at most."""
        return -(-self.most // BATCH)

    def campaign(self) -> Campaign:
        """Return all points, a batch each: all amounts in the first round, then all again."""
        points = [{'kind': kind, 'scatter': amount} for kind, amount in self.cells]
        shared = common(self.design, self.settings)
        return Campaign('tolerance', evaluate, shared, points * self.rounds, self.seed)

    def count(self, ledger: Ledger, executor: Executor | None) -> Iterator[Row]:
        """Evaluate batches, round by round, of the amounts of which too little has failed yet.

        What is done next follows from what came out before alone, so that a study that was
        killed goes on as if it had not been.
        """
        campaign, size = self.campaign(), len(self.cells)
        open_cells = list(range(size))
        for number in range(self.rounds):
            points = [number * size + cell for cell in open_cells]
            yield from run(campaign, ledger, executor, points)
            rows = [
                ledger.rows[point] for point in sorted(ledger.rows) if point % size in open_cells
            ]
            open_cells = [cell for cell in open_cells if self._is_open(self._of(rows, cell))]

    def _of(self, rows: Sequence[Row], cell: int) -> list[Row]:
        return [row for row in rows if row['point'] % len(self.cells) == cell]

    def _is_open(self, rows: Sequence[Row]) -> bool:
        """Return whether nothing has failed often enough yet."""
        return all(self.rate(rows, failure).failures < ENOUGH for failure in FAILURES)

    # --- what came out ---------------------------------------------------------------------

    def rate(self, rows: Sequence[Row], failure: str, level: int | None = None) -> Rate:
        """Return the rate at which a step or a read fails, of one level or of all.

        Args:
            rows: Points, all of the same kind and amount.
            failure: One of `FAILURES`.
            level: The level it starts from or reads; None for all.
        """
        count = self.design.levels - (failure == 'step')
        levels = range(count) if level is None else [level]
        failures = sum(row[f'{failure}_{level}'] for row in rows for level in levels)
        return Rate(failures, len(levels) * sum(row['elements'] for row in rows))

    def curve(
        self, rows: Sequence[Row], kind: str, failure: str
    ) -> tuple[list[float], list[Rate]]:
        """Return amounts of a kind and the rates that were counted at them."""
        amounts = [amount for name, amount in self.cells if name == kind]
        chosen = [
            [row for row in rows if row['kind'] == kind and row['scatter'] == amount]
            for amount in amounts
        ]
        counted = [
            (a, self.rate(some, failure)) for a, some in zip(amounts, chosen, strict=True) if some
        ]
        return [amount for amount, _ in counted], [rate for _, rate in counted]

    def rare(
        self, rows: Sequence[Row], kind: str, failure: str
    ) -> tuple[float, float, float] | None:
        """Return the amount at which one in a thousand fails, with its interval."""
        return rare_scatter(*self.curve(rows, kind, failure), seed=self.seed)
