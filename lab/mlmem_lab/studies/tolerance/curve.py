# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Failures by amount of one kind of randomness, counted where they are most informative.

Amounts form a ladder. Bisection with one batch per rung finds where one in ten fails; from there
counting goes down the ladder until fewer than one in a thousand fail, and up until half do.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mlmem import Settings
from mlmem.physics import Design

from .element import WORD_TRIALS, Row, count_elements, count_trials, evaluate_batch, split_kinds
from .estimate import ENOUGH_FAILURES, RARE_RATE, Rate, pool_failures, rare_scatter


def next_rung(
    rates: Mapping[int, Rate], rungs: int, most: int, first_rate: float = 0.1
) -> int | None:
    """Return the rung to count next; None if the curve is known.

    Args:
        rates: What was counted, by rung; the last rung has the largest scatter.
        most: Trials at a rung after which counting stops there.
        first_rate: Rate to find first, because one batch can show it.
    """
    below, edge = -1, rungs
    while edge - below > 1:
        middle = (below + edge) // 2
        if middle not in rates:
            return middle
        if rates[middle].value < first_rate:
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
        if rates[rung - 1].value >= 0.5:
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


def list_amounts(kind: str, per_decade: int) -> list[float]:
    """Return the amounts of a kind that may be counted, rising."""
    least, most = 1e-8, 0.3  # of a relative scatter, or cells
    if {'noise', 'vibration'} & set(split_kinds(kind)):
        most = 1e-2  # of the pulse's amplitude
    last = int(per_decade * np.log10(most / least) + 1e-9)
    powers = np.arange(last + 1) / per_decade
    return [float(f'{amount:.3g}') for amount in least * 10.0**powers]


def count_curve(
    design: Design, settings: Settings, kind: str, tried: str, most: int, seed: int = 0
) -> list[Row]:
    """Count failures until the curve is known, and return the sums of the batches by amount.

    Amounts rise; for the sums see `evaluate_batch`.

    Args:
        kind: What is random.
        tried: What is tried.
        most: Trials of an amount after which counting stops, however few have failed.
        seed: Of all batches, each of which has one of its own.
    """
    # per decade; trials of words take long
    amounts = list_amounts(kind, 5 if tried in WORD_TRIALS else 10)
    each, elements = count_trials(design, tried), count_elements(design, tried)
    counts: dict[int, Counter[str]] = {}
    rates: dict[int, Rate] = {}
    while (rung := next_rung(rates, len(amounts), most)) is not None:
        rate, amount = rates.get(rung), amounts[rung]
        done = rate.trials // (each * elements) if rate else 0
        more = math.ceil(count_missing_trials(rate, most) / (each * elements))
        for number in range(done, done + more):
            entropy = [seed, *f'{kind} {tried} {amount:g} {number:05}'.encode()]
            state = np.random.SeedSequence(entropy).generate_state(1, np.uint64)
            batch_seed = int(state[0] >> np.uint64(1))
            found = evaluate_batch(design, settings, kind, tried, amount, batch_seed)
            counts.setdefault(rung, Counter()).update(found)
        rates[rung] = pool_row(counts[rung])
    return [{'amount': amounts[rung], **counts[rung]} for rung in sorted(counts)]


def pool_row(row: Mapping[str, Any]) -> Rate:
    """Return the failure rate of the batches of an amount."""
    each = row['trials'] // row['elements']
    return pool_failures(row['elements'], each, row['failures'], row['squares'])


def list_rates(rows: Sequence[Row]) -> tuple[list[float], list[Rate]]:
    """Return the amounts of a curve, rising, and the rates at them."""
    return [row['amount'] for row in rows], [pool_row(row) for row in rows]


def describe_rare_amount(
    rows: Sequence[Row], seed: int = 0
) -> tuple[tuple[float, float, float] | None, str]:
    """Return the amount at which one in a thousand fails, with its interval, and as text.

    Returns:
        None if the counts determine none; the text then says what was counted.
    """
    amounts, rates = list_rates(rows)
    if (found := rare_scatter(amounts, rates, seed=seed)) is not None:
        return found, f'{found[0]:.2g} ({found[1]:.2g} to {found[2]:.2g})'
    failing = next((i for i, rate in enumerate(rates) if rate.failures), len(rates))
    words = []
    if failing > 0:
        words.append(f'none of {rates[failing - 1].trials} at {amounts[failing - 1]:.2g}')
    if failing < len(rates):
        words.append(f'{rates[failing].value:.2g} of all at {amounts[failing]:.2g}')
    return None, ', '.join(words)
