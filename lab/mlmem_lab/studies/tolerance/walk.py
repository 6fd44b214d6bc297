# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which amount of scatter to count next: first where failures begin, then around it.

Amounts form a ladder. Bisection with one batch per rung finds where one in ten fails; from there
counting goes down the ladder until fewer than one in a thousand fail, and up until half do. So
every design is counted around its own failures.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from .estimate import ENOUGH, RARE, Rate

BEGIN = 0.1
"""Rate to find first, because one batch can show it."""

HALF = 0.5
"""Rate above which counting stops."""


def next_rung(rates: Mapping[int, Rate], rungs: int, most: int) -> int | None:
    """Return the rung to count next; None if the curve is known.

    Args:
        rates: What was counted, by rung; the last rung has the largest scatter.
        rungs: How many there are.
        most: Trials at a rung after which counting stops there.
    """
    below, edge = -1, rungs
    while edge - below > 1:
        middle = (below + edge) // 2
        if middle not in rates:
            return middle
        if rates[middle].value < BEGIN:
            below = middle
        else:
            edge = middle
    edge = min(edge, rungs - 1)
    for rung in range(edge, -1, -1):
        if not counted(rates.get(rung), most):
            return rung
        if rates[rung].value < RARE:
            break
    for rung in range(edge + 1, rungs):
        if rates[rung - 1].value >= HALF:
            break
        if not counted(rates.get(rung), most):
            return rung
    return None


def counted(rate: Rate | None, most: int) -> bool:
    """Return whether a rung needs no more trials."""
    return rate is not None and (rate.effective[0] >= ENOUGH or rate.trials >= most)


def trials_wanted(rate: Rate | None, most: int) -> int:
    """Return how many more trials to make: likely enough, but at most as many again."""
    if rate is None:
        return 1
    likely = math.ceil(rate.trials * (ENOUGH / max(rate.effective[0], 1.0) - 1.0))
    return max(1, min(likely, rate.trials, most - rate.trials))
