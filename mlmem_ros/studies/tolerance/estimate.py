# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Error rates from counts: intervals, when to stop counting, and where one in a thousand fails.

The law between scatter and failure is that of structural reliability: what decides a step (a
barrier less the force that has to cross it) departs from its nominal value b in proportion to
the scatter, so that one spot of the element fails with probability Phi(-b / sigma) (FORM, first
order), and a step that passes k independent spots with 1 - (1 - Phi(-b / sigma))^k.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq, minimize
from scipy.special import log_ndtr
from scipy.stats import beta

CONFIDENCE = 0.95
"""Of every interval."""

ENOUGH = 30
"""Failures after which counting stops (inverse binomial sampling, Haldane 1945): the relative
error of a rate is then about 1 / sqrt(30), 18 %, however small the rate."""

RARE = 1e-3
"""The failure rate whose scatter is looked for."""


@dataclass(frozen=True)
class Rate:
    """A failure rate as counted.

    Attributes:
        failures: How many failed.
        trials: Of how many.
    """

    failures: int
    trials: int

    @property
    def value(self) -> float:
        """The share that failed."""
        return self.failures / self.trials

    @property
    def interval(self) -> tuple[float, float]:
        """The exact two-sided confidence interval (Clopper and Pearson 1934)."""
        tail = 0.5 * (1.0 - CONFIDENCE)
        k, n = self.failures, self.trials
        low = 0.0 if k == 0 else float(beta.ppf(tail, k, n - k + 1))
        high = 1.0 if k == n else float(beta.ppf(1.0 - tail, k + 1, n - k))
        return low, high


@dataclass(frozen=True)
class Law:
    """Failure rate against scatter: 1 - (1 - Phi(-b / sigma))^k.

    Attributes:
        b: Scatter at which a spot fails once in 6.3, Phi(-1).
        k: Number of independent spots.
    """

    b: float
    k: float

    def rate(self, sigma: np.ndarray | float) -> np.ndarray:
        """Return the failure rate at scatters above 0."""
        return -np.expm1(self.k * log_ndtr(self.b / np.asarray(sigma, dtype=float)))

    def sigma(self, rate: float) -> float:
        """Return the scatter at which a rate is reached."""
        low, high = self.b / 40.0, self.b * 1e3
        return float(brentq(lambda sigma: float(self.rate(sigma)) - rate, low, high))


def fit(sigmas: Sequence[float], rates: Sequence[Rate]) -> Law | None:
    """Return the law of the greatest likelihood, or None where the counts tell none.

    Args:
        sigmas: Scatters above 0.
        rates: What was counted at each; at least two of them neither none nor all.
    """
    inner = [0 < rate.failures < rate.trials for rate in rates]
    if sum(inner) < 2:
        return None
    sigma = np.array(sigmas)
    failed = np.array([rate.failures for rate in rates], dtype=float)
    passed = np.array([rate.trials for rate in rates]) - failed

    def loss(x: np.ndarray) -> float:
        log_pass = np.exp(x[1]) * log_ndtr(np.exp(x[0]) / sigma)
        log_fail = np.log(np.maximum(-np.expm1(log_pass), 1e-300))
        return -float(np.sum(failed * log_fail + passed * log_pass))

    starts = [(np.log(sigma[inner].mean() * z), y) for z in (1.0, 3.0) for y in (0.0, 2.0)]
    best = min(
        (minimize(loss, start, method='Nelder-Mead') for start in starts), key=lambda r: r.fun
    )
    return Law(float(np.exp(best.x[0])), float(np.exp(best.x[1])))


def rare_scatter(
    sigmas: Sequence[float], rates: Sequence[Rate], seed: int = 0, repeats: int = 200
) -> tuple[float, float, float] | None:
    """Return the scatter at which one in a thousand fails, and its interval.

    The interval is that of the parametric bootstrap: counts are drawn anew from the law and
    fitted again.

    Args:
        sigmas: Scatters.
        rates: What was counted at each.
        seed: Of the bootstrap.
        repeats: Number of draws.
    """
    law = fit(sigmas, rates)
    if law is None:
        return None
    random = np.random.default_rng(seed)
    expected = law.rate(np.array(sigmas))
    found = []
    for _ in range(repeats):
        drawn = [
            Rate(int(random.binomial(rate.trials, p)), rate.trials)
            for rate, p in zip(rates, expected, strict=True)
        ]
        if (again := fit(sigmas, drawn)) is not None:
            found.append(again.sigma(RARE))
    tail = 50.0 * (1.0 - CONFIDENCE)
    low, high = np.percentile(found, [tail, 100.0 - tail])
    return law.sigma(RARE), float(low), float(high)
