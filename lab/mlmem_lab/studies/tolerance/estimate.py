# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Error rates from counts: intervals, when to stop counting, and where one in a thousand fails.

Failure against scatter is a fragility curve as in structural reliability: a normal distribution of
the logarithm of the scatter. It is fitted to the lowest counts only, its foot, because the levels
of an element fail at different scatters, and no single curve fits them all from the first failure
to the last.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize
from scipy.special import betaincinv, log_ndtr, ndtr, ndtri

CONFIDENCE_LEVEL = 0.95
"""Confidence level of every interval."""

ENOUGH_FAILURES = 30
"""Failures after which counting stops (inverse binomial sampling, Haldane 1945): the relative
error of a rate is then about 1 / sqrt(30), 18 %, however small the rate."""

RARE_RATE = 1e-3
"""The failure rate whose scatter is sought."""


@dataclass(frozen=True)
class Rate:
    """A counted failure rate.

    Attributes:
        clustering: Variance of the count over that of independent trials (the design effect).
            What spoils an element may spoil all its levels.
    """

    failures: float
    trials: int
    clustering: float = 1.0

    @property
    def value(self) -> float:
        """The fraction that failed."""
        return self.failures / self.trials

    @property
    def effective(self) -> tuple[float, float]:
        """Failures and trials of independent trials with the same information."""
        return self.failures / self.clustering, self.trials / self.clustering

    @property
    def interval(self) -> tuple[float, float]:
        """The two-sided confidence interval, exact for independent trials.

        That of Clopper and Pearson (1934), with the effective counts of Korn and Graubard
        (1998) where trials cluster.
        """
        tail = 0.5 * (1.0 - CONFIDENCE_LEVEL)
        k, n = self.effective
        low = 0.0 if self.failures == 0 else float(betaincinv(k, n - k + 1.0, tail))
        all_failed = self.failures == self.trials
        high = 1.0 if all_failed else float(betaincinv(k + 1.0, n - k, 1.0 - tail))
        return low, high


def pool_failures(elements: int, each: int, failures: float, squares: float) -> Rate:
    """Return the failure rate of elements that were tried several times each.

    Args:
        squares: Sum over the elements of the square of the number of their failures.
    """
    trials = elements * each
    p = failures / trials
    if p <= 0.0 or p >= 1.0:
        return Rate(failures, trials)
    if elements == 1:  # nothing shows whether the trials of one element are dependent
        return Rate(failures, trials, float(each))
    variance = (squares - failures**2 / elements) / (elements - 1)
    return Rate(failures, trials, max(1.0, variance / (each * p * (1.0 - p))))


@dataclass(frozen=True)
class Fragility:
    """Failure rate against scatter: Phi(ln(sigma / median) / spread).

    Attributes:
        median: Scatter at which half fail.
        spread: Standard deviation of the logarithm of the scatter at which one fails.
    """

    median: float
    spread: float

    def rate(self, sigma: np.ndarray | float) -> np.ndarray:
        """Return the failure rate at scatters above 0."""
        return np.asarray(ndtr(np.log(np.asarray(sigma) / self.median) / self.spread))

    def sigma(self, rate: float) -> float:
        """Return the scatter at which a rate between 0 and 1 is reached."""
        return float(self.median * np.exp(self.spread * ndtri(rate)))


def foot_length(rates: Sequence[Rate], max_rate: float = 0.02) -> int:
    """Return how many counts, in order of scatter, belong to the foot of the curve.

    They include the first one above the greatest rate of the foot, so that there is a slope.
    """
    steep = [i for i, rate in enumerate(rates) if rate.value > max_rate]
    return steep[0] + 1 if steep else len(rates)


def fit_fragility(sigmas: Sequence[float], rates: Sequence[Rate]) -> Fragility | None:
    """Return the maximum-likelihood curve, or None if the counts determine none.

    Scatters are above 0 and rise. At least two counts in the foot must have some failures, but not
    all.
    """
    end = foot_length(rates)
    if sum(0 < rate.failures < rate.trials for rate in rates[:end]) < 2:
        return None
    logs = np.log(np.array(sigmas[:end]))
    failed, tried = np.array([rate.effective for rate in rates[:end]]).T
    passed = tried - failed

    def negative_likelihood(x: np.ndarray) -> float:
        z = (logs - x[0]) / np.exp(x[1])
        return -float(np.sum(failed * log_ndtr(z) + passed * log_ndtr(-z)))

    best = minimize(negative_likelihood, (logs[-1] + 1.0, 0.0), method='Nelder-Mead')
    return Fragility(float(np.exp(best.x[0])), float(np.exp(best.x[1])))


def rare_scatter(
    sigmas: Sequence[float], rates: Sequence[Rate], seed: int = 0, repeats: int = 200
) -> tuple[float, float, float] | None:
    """Return the scatter at which one in a thousand fails, and its interval.

    The interval is from a parametric bootstrap: counts are drawn from the curve and fitted again.
    """
    curve = fit_fragility(sigmas, rates)
    if curve is None:
        return None
    random = np.random.default_rng(seed)
    end = foot_length(rates)
    expected = curve.rate(np.array(sigmas[:end]))
    found = []
    for _ in range(repeats):
        drawn = []
        for rate, p in zip(rates, expected, strict=False):
            trials = max(1, round(rate.effective[1]))
            drawn.append(Rate(int(random.binomial(trials, p)), trials))
        if (again := fit_fragility(sigmas[:end], drawn)) is not None:
            found.append(again.sigma(RARE_RATE))
    tail = 50.0 * (1.0 - CONFIDENCE_LEVEL)
    low, high = np.percentile(found, [tail, 100.0 - tail])
    return curve.sigma(RARE_RATE), float(low), float(high)
