# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which amount of scatter to count next: first where failures begin, then around it.

Amounts stand on a ladder. Where one in ten fails is found by bisection with a batch at every rung;
from there counting goes down the ladder until fewer than one in a thousand fail, and up until
half do. So every design is counted where it fails, however different from another's.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from .estimate import ENOUGH, RARE, Rate

BEGIN = 0.1
"""Rate sought first, because a batch shows it."""

HALF = 0.5
"""Rate up to which counting goes."""


def next_rung(rates: Mapping[int, Rate], rungs: int, most: int) -> int | None:
    """Return the rung to count next; None if the curve is known.

    Args:
        rates: What was counted, by rung; the largest scatter is on the last.
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
    """Return how many more trials to make: what is likely to be enough, at most as many again."""
    if rate is None:
        return 1
    likely = math.ceil(rate.trials * (ENOUGH / max(rate.effective[0], 1.0) - 1.0))
    return max(1, min(likely, rate.trials, most - rate.trials))
