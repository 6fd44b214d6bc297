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
from typing import Any

import numpy as np

from mlmem import Settings
from mlmem.instrument.end import End
from mlmem.physics import Design

from ...study import RowFile
from .element import (
    ALL_KINDS,
    JOINED_BY,
    KICK_TRIAL,
    STEP_TRIAL,
    WORD_TRIALS,
    Row,
    count_elements,
    count_trials,
    evaluate_batch,
)
from .estimate import ENOUGH_FAILURES, RARE_RATE, Rate, pool_failures, rare_scatter

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
        kinds: What is random, one at a time; or several kinds at once, as `alpha+mass`.
        tried: What is tried, one at a time; by default a step and a read from every end.
        amounts: How many amounts per decade.
        most: Trials of an amount after which counting stops, however few have failed.
    """

    design: Design
    settings: Settings
    kinds: tuple[str, ...] = ALL_KINDS
    tried: tuple[str, ...] = ()
    amounts: int = 10
    most: int = 3000
    seed: int = 0

    def __post_init__(self) -> None:
        if unknown := sorted(set(JOINED_BY.join(self.kinds).split(JOINED_BY)) - set(ALL_KINDS)):
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
        object.__setattr__(self, 'tried', self.tried or usual)

    @property
    def curves(self) -> list[tuple[str, str]]:
        """What is counted by amount: kinds of randomness and what is tried."""
        return [(kind, tried) for kind in self.kinds for tried in self.tried]

    def ladder(self, kind: str) -> list[float]:
        """Return the amounts of a kind that may be counted, rising."""
        most = min(MAX_AMOUNTS[name] for name in kind.split(JOINED_BY))
        last = int(self.amounts * np.log10(most / MIN_AMOUNT) + 1e-9)
        powers = np.arange(last + 1) / self.amounts
        return [float(f'{amount:.3g}') for amount in MIN_AMOUNT * 10.0**powers]

    @property
    def shared(self) -> dict[str, Any]:
        """What all batches share."""
        return {'design': self.design.as_dict(), 'settings': self.settings.as_dict()}

    @property
    def definition(self) -> dict[str, Any]:
        """What all counts depend on."""
        return self.shared | {'seed': self.seed}

    def count(self, file: RowFile, executor: Executor | None) -> Iterator[str]:
        """Evaluate batches where they are most informative, until every curve is known; yield the
        key of each.

        The next batch follows from earlier results alone, so a killed study continues as if it had
        never stopped.
        """
        counted: list[Row] = []
        while tasks := self._list_next(counted):
            yield from file.compute(evaluate_batch, tasks, executor)
            counted += [file.rows[key] for key in tasks]

    def select_rows(self, file: RowFile) -> list[Row]:
        """Return the rows of a file that belong to this study, in order of their keys."""
        rows = (file.rows[key] for key in sorted(file.rows))
        return [row for row in rows if (row['kind'], row['tried']) in self.curves]

    def _list_next(self, rows: Sequence[Row]) -> dict[str, tuple[Any, ...]]:
        """Return the batches to be evaluated next, of every curve at one amount, by key."""
        tasks: dict[str, tuple[Any, ...]] = {}
        for kind, tried in self.curves:
            ladder = self.ladder(kind)
            amounts, rates = self.rates(rows, kind, tried)
            known = {ladder.index(a): rate for a, rate in zip(amounts, rates, strict=True)}
            if (rung := next_rung(known, len(ladder), self.most)) is None:
                continue
            rate, amount = known.get(rung), ladder[rung]
            batch = count_elements(self.design, tried) * count_trials(self.design, tried)
            first = rate.trials // batch if rate else 0
            for number in range(first, first - (-count_missing_trials(rate, self.most) // batch)):
                key = f'{kind} {tried} {amount:g} {number:05}'
                entropy = np.random.SeedSequence([self.seed, *key.encode()])
                seed = int(entropy.generate_state(1, np.uint64)[0] >> np.uint64(1))
                tasks[key] = (self.shared, kind, tried, amount, seed)
        return tasks

    def rates(self, rows: Sequence[Row], kind: str, tried: str) -> tuple[list[float], list[Rate]]:
        """Return the amounts of a kind that were counted, rising, and the rates at them."""
        found: dict[float, list[Row]] = {}
        for row in rows:
            if (row['kind'], row['tried']) == (kind, tried):
                found.setdefault(row['amount'], []).append(row)
        each, amounts = count_trials(self.design, tried), sorted(found)
        sums = (
            [
                sum(row[name] for row in found[amount])
                for name in ('elements', 'failures', 'squares')
            ]
            for amount in amounts
        )
        return amounts, [
            pool_failures(elements, each, failures, squares)
            for elements, failures, squares in sums
        ]

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
