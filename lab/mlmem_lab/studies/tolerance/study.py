# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The study: what is tried, by kind of randomness and amount, counted where failures occur.

Amounts form a ladder. Bisection with one batch per rung finds where one in ten fails; from there
counting goes down the ladder until fewer than one in a thousand fail, and up until half do.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from mlmem import Settings
from mlmem.instrument.end import End
from mlmem.physics import Design
from mlmem.readers.words import count_words

from ..campaign import Campaign, Ledger, Row, run
from .element import (
    ALL_KINDS,
    ASTRAY_NAMES,
    KICK_TRIAL,
    MISREAD_KINDS,
    STEP_TRIAL,
    WORD_TRIAL,
    WORD_TRIALS,
    batch_size,
    evaluate_point,
    is_screened,
)
from .estimate import ENOUGH_FAILURES, RARE_RATE, Rate, bits_kept, pool_failures, rare_scatter
from .particle import DRAWN_PER_SCREENED, MAX_FAILURE_WEIGHT

FIRST_RATE = 0.1
"""Rate to find first, because one batch can show it."""

MAX_COUNTED_RATE = 0.5
"""Rate above which counting stops."""


def next_rung(rates: Mapping[int, Rate], rungs: int, most: int) -> int | None:
    """Return the rung to count next; None if the curve is known.

    Args:
        rates: What was counted, by rung; the last rung has the largest scatter.
        most: Trials at a rung after which counting stops there.
    """
    below, edge = -1, rungs
    while edge - below > 1:
        middle = (below + edge) // 2
        if middle not in rates:
            return middle
        if rates[middle].value < FIRST_RATE:
            below = middle
        else:
            edge = middle
    edge = min(edge, rungs - 1)
    for rung in range(edge, -1, -1):
        if not is_counted(rates.get(rung), most):
            return rung
        if rates[rung].value < RARE_RATE:
            break
    for rung in range(edge + 1, rungs):
        if rates[rung - 1].value >= MAX_COUNTED_RATE:
            break
        if not is_counted(rates.get(rung), most):
            return rung
    return None


def is_counted(rate: Rate | None, most: int) -> bool:
    """Return whether a rung needs no more trials."""
    return rate is not None and (rate.effective[0] >= ENOUGH_FAILURES or rate.trials >= most)


def count_missing_trials(rate: Rate | None, most: int) -> int:
    """Return how many more trials to make: likely enough, but at most as many again."""
    if rate is None:
        return 1
    likely = math.ceil(rate.trials * (ENOUGH_FAILURES / max(rate.effective[0], 1.0) - 1.0))
    return max(1, min(likely, rate.trials, most - rate.trials))


MIN_AMOUNT = 1e-8
"""Least amount of scatter, noise or vibration studied."""

MAX_AMOUNTS = dict.fromkeys(ALL_KINDS, 0.3) | {'noise': 1e-2, 'vibration': 1e-2}
"""Greatest amounts: of a relative scatter or a third of a cell; of the pulse's amplitude."""


@dataclass(frozen=True)
class Tolerance:
    """A study of the randomness in fabrication, sensors and base that an element tolerates.

    Attributes:
        kinds: What is random, one at a time.
        tried: What is tried, one at a time; by default a step and a read from every end that the
            instrument uses.
        amounts: How many amounts per decade.
        most: Trials of an amount after which counting stops, however few have failed.
        screen: Whether a forecast chooses which steps to simulate, see `screen`.
        levels: How many levels of each element are tried, drawn anew for each; 0 for all.
    """

    design: Design
    settings: Settings
    kinds: tuple[str, ...] = ALL_KINDS
    tried: tuple[str, ...] = ()
    amounts: int = 10
    most: int = 3000
    screen: bool = False
    levels: int = 0
    seed: int = 0

    def __post_init__(self) -> None:
        if unknown := sorted(set(self.kinds) - set(ALL_KINDS)):
            raise ValueError(f'kinds must be of {", ".join(ALL_KINDS)}; got {", ".join(unknown)}')
        usual = (STEP_TRIAL, *(end.value for end in End))
        possible = (STEP_TRIAL, KICK_TRIAL, *WORD_TRIALS, *usual[1:])
        if unknown := sorted(set(self.tried) - set(possible)):
            raise ValueError(f'tried must be of {", ".join(possible)}; got {", ".join(unknown)}')
        kicked = self.settings.kick.wall_speeds
        if KICK_TRIAL in self.tried and not (len(kicked) == self.design.levels and all(kicked)):
            raise ValueError('tried can be kick only where every level has one (kick.speeds)')
        if set(WORD_TRIALS) & set(self.tried) and not self.settings.register.spacing:
            raise ValueError(
                f'tried can be {", ".join(WORD_TRIALS)} only in a register (register.spacing)'
            )
        if self.amounts < 1 or self.most < 1:
            raise ValueError(
                f'amounts and most must be at least 1; got {self.amounts}, {self.most}'
            )
        if self.levels < 0:
            raise ValueError(f'levels must be at least 1, or 0 for all; got {self.levels}')
        object.__setattr__(self, 'tried', self.tried or usual)

    @cached_property
    def curves(self) -> list[tuple[str, str]]:
        """What is counted by amount: kinds of randomness and what is tried."""
        return [(kind, tried) for kind in self.kinds for tried in self.tried]

    def ladder(self, kind: str) -> list[float]:
        """Return the amounts of a kind that may be counted, rising."""
        last = int(self.amounts * np.log10(MAX_AMOUNTS[kind] / MIN_AMOUNT) + 1e-9)
        powers = np.arange(last + 1) / self.amounts
        return [float(f'{amount:.3g}') for amount in MIN_AMOUNT * 10.0**powers]

    @cached_property
    def cells(self) -> list[tuple[str, str, float]]:
        """Everything that may be counted: kind, what is tried, and amount."""
        return [(*curve, amount) for curve in self.curves for amount in self.ladder(curve[0])]

    @cached_property
    def shared(self) -> dict[str, Any]:
        """What all points share."""
        return {
            'design': self.design.as_dict(), 'settings': self.settings.as_dict(),
            'screen': self.screen, 'levels': self.levels,
        }  # fmt: skip

    def trials(self, kind: str, tried: str) -> int:
        """Return how many trials a batch has."""
        elements, each = batch_size(self.shared, kind, tried)
        return elements * each

    def limit(self, kind: str, tried: str) -> int:
        """Return the most trials of an amount; with a screen more are drawn."""
        return self.most * (DRAWN_PER_SCREENED if is_screened(self.shared, kind, tried) else 1)

    def campaign(self) -> Campaign:
        """Return all points that may be needed, a batch each: all amounts, then all again."""
        points = [
            dict(zip(('kind', 'tried', 'scatter'), cell, strict=True)) for cell in self.cells
        ]
        rounds = max(-(-self.limit(*curve) // self.trials(*curve)) for curve in self.curves)
        return Campaign('tolerance', evaluate_point, self.shared, points * rounds, self.seed)

    def count(self, ledger: Ledger, executor: Executor | None) -> Iterator[Row]:
        """Evaluate batches where they are most informative, until every curve is known.

        The next batch follows from earlier results alone, so a killed study continues as if it had
        never stopped.
        """
        campaign = self.campaign()
        seen: list[list[Row]] = [[] for _ in self.cells]
        while points := self._next(seen):
            yield from run(campaign, ledger, executor, points)
            for point in points:
                seen[point % len(seen)].append(ledger.rows[point])

    def _next(self, seen: Sequence[Sequence[Row]]) -> list[int]:
        """Return the points to be evaluated next, of every curve at one amount."""
        points, first = [], 0
        for kind, tried in self.curves:
            rungs = len(self.ladder(kind))
            counted = enumerate(seen[first : first + rungs])
            rates = {rung: self.rate(rows) for rung, rows in counted if rows}
            most = self.limit(kind, tried)
            if (rung := next_rung(rates, rungs, most)) is not None:
                batches = -(
                    -count_missing_trials(rates.get(rung), most) // self.trials(kind, tried)
                )
                done = len(seen[first + rung])
                points += [
                    number * len(seen) + first + rung for number in range(done, done + batches)
                ]
            first += rungs
        return points

    # --- results ---------------------------------------------------------------------------

    def rate(self, rows: Sequence[Row]) -> Rate:
        """Return the rate at which steps or reads of all levels fail.

        All rows have the same kind, amount and thing tried.
        """
        what = rows[0]['kind'], rows[0]['tried']
        elements, squares = (sum(row[name] for row in rows) for name in ('elements', 'squares'))
        failures = sum(row[name] for row in rows for name in row if name.startswith('failed_'))
        heaviest = MAX_FAILURE_WEIGHT if is_screened(self.shared, *what) else 1.0
        return pool_failures(
            elements, batch_size(self.shared, *what)[1], failures, squares, heaviest
        )

    def rates(self, rows: Sequence[Row], kind: str, tried: str) -> tuple[list[float], list[Rate]]:
        """Return the amounts of a kind that were counted, rising, and the rates at them."""
        found: dict[float, list[Row]] = {}
        for row in rows:
            if (row['kind'], row['tried']) == (kind, tried):
                found.setdefault(row['scatter'], []).append(row)
        amounts = sorted(found)
        return amounts, [self.rate(found[amount]) for amount in amounts]

    def how(self, rows: Sequence[Row], kind: str, tried: str) -> list[dict[str, float]]:
        """Return for every amount of a kind how many words were tried, and how many failed how;
        of reads also the `bits` that are kept.

        See `ASTRAY_NAMES` and `MISREAD_KINDS`.
        """
        names = tuple(ASTRAY_NAMES.values()) if tried == WORD_TRIAL else MISREAD_KINDS
        found: dict[float, dict[str, float]] = {}
        for row in rows:
            if (row['kind'], row['tried']) == (kind, tried):
                counts = found.setdefault(row['scatter'], dict.fromkeys(('tried', *names), 0))
                counts['tried'] += row['tried_0']
                for name in names:
                    counts[name] += row[name]
        if tried != WORD_TRIAL:
            words = count_words(self.design, self.settings)
            for counts in found.values():
                failed = (counts[name] / counts['tried'] for name in MISREAD_KINDS[:2])
                counts['bits'] = round(bits_kept(words, *failed), 3)
        return [{'amount': amount, **found[amount]} for amount in sorted(found)]

    def rare_amount(
        self, rows: Sequence[Row], kind: str, tried: str
    ) -> tuple[tuple[float, float, float] | None, str]:
        """Return the amount at which one in a thousand fails, with its interval, and as text.

        Returns:
            None if the counts determine none; the text then says what was counted.
        """
        amounts, rates = self.rates(rows, kind, tried)
        if (found := rare_scatter(amounts, rates, seed=self.seed)) is not None:
            return found, f'{found[0]:.2g} ({found[1]:.2g} to {found[2]:.2g})'
        failing = next((i for i, rate in enumerate(rates) if rate.failures), len(rates))
        words = []
        if failing > 0:
            words.append(f'none of {rates[failing - 1].trials} at {amounts[failing - 1]:.2g}')
        if failing < len(rates):
            words.append(f'{rates[failing].value:.2g} of all at {amounts[failing]:.2g}')
        return None, ', '.join(words)
