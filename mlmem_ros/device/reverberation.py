# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reverberation: what may still be on its way to an end.

An end that is still for a moment proves nothing: a packet of waves bounces between the wall and
the end, and between two arrivals it is not seen. But on its way it only loses energy, so what an
end has seen bounds what it will see again: its greatest motion, less exp(-eta t / 2). That holds
for everything that has reached an end at least once since it was excited.
"""

from __future__ import annotations

import math
from dataclasses import MISSING, dataclass, replace

import numpy as np

from ..described import described
from ..physics import Design
from ..physics.portable import exponential
from ..physics.potential import Array
from .echo import loudness, weights
from .settings import ProbeSettings

LONG_AGO = 2**53
"""More samples than are ever taken."""


@dataclass(frozen=True)
class Returns:
    """What is known of the waves that an end may still see."""

    bound: float = described(
        MISSING,
        'greatest mean |v| of the carrier in a tick that may still arrive, in cells',
        low=0.0,
    )
    since: int = described(MISSING, 'samples since the end was last driven', low=0)
    seen: int = described(MISSING, 'samples in which that motion itself is seen', low=0)


NOTHING = Returns(0.0, LONG_AGO, 0)
"""Of an end that was never driven."""


class Reverberation:
    """Follows the waves at one end.

    Attributes:
        returns: What is known of them.
        gain: Mean |v| that the filter leaves of a white noise with mean |v| of 1.
        memory: Samples that the filter looks back.
    """

    def __init__(self, design: Design, probe: ProbeSettings, dt: float) -> None:
        """Follow an end that is at rest, for the echoes of a probe, sampled at intervals dt."""
        self.returns = NOTHING
        self._weights = weights(probe, dt)
        self._loss = 0.5 * design.eta * dt
        self._kept: dict[int, float] = {}
        self.gain = math.sqrt(float(np.square(self._weights).sum()))
        self.memory = len(self._weights) - 1

    def ignore(self, samples: int) -> None:
        """Ignore the end while it is driven, for some samples: its waves are yet to return."""
        self.returns = Returns(self.returns.bound, 0, samples + self.memory)

    def returned(self) -> None:
        """Take note that the waves of its last motion have come back, so that they are bounded."""
        self.returns = replace(self.returns, since=LONG_AGO)

    def fades(self, limit: float) -> int:
        """Return after how many samples the bound is at a limit at the earliest; it may be never.

        Without damping, waves are bounded by what they were.
        """
        if self.returns.bound <= limit:
            return 0
        if self._loss == 0.0:
            return LONG_AGO
        return max(1, math.floor(math.log(self.returns.bound / limit) / self._loss))

    def loudness(self, v: float, n: int) -> float:
        """Return the mean |v| of the carrier in a tick of n samples which, as all before, are v.

        The filter removes a constant up to rounding.
        """
        return loudness(np.full(self.memory + n, v), self._weights, 1)[0]

    def pass_by(self, loudness: float, n: int, ticks: int) -> None:
        """Take ticks of n samples that are all the same; see `loudness`. Nothing is driven."""
        bound, since, seen = self.returns.bound, self.returns.since, self.returns.seen
        if bound > loudness:
            fading = np.full(ticks + 1, self._share(n))
            fading[0] = bound
            bound = float(np.multiply.accumulate(fading)[-1])  # one by one, as in `follow`
        since = min(since + n * ticks, LONG_AGO)
        self.returns = Returns(max(bound, loudness), since, seen)

    def follow(self, v: Array, ticks: int) -> None:
        """Take the samples of ticks, shape (memory + n,), after those that the filter needs."""
        n = (len(v) - self.memory) // ticks
        kept = self._share(n)
        bound, since, seen = self.returns.bound, self.returns.since, self.returns.seen
        for loud in loudness(v, self._weights, ticks):
            bound = max(kept * bound, loud if since >= seen else 0.0)
            since = min(since + n, LONG_AGO)
        self.returns = Returns(bound, since, seen)

    def _share(self, n: int) -> float:
        """Return what is left of a wave after n samples."""
        if n not in self._kept:
            self._kept[n] = float(exponential(np.array(-self._loss * n)))
        return self._kept[n]
