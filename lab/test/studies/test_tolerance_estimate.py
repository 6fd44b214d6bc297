# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Tolerance: the statistics against known laws, and where counting goes."""

import math

import numpy as np
import pytest

from mlmem_lab.studies.tolerance.curve import count_missing_trials, next_rung
from mlmem_lab.studies.tolerance.estimate import (
    RARE_RATE,
    Fragility,
    Rate,
    fit_fragility,
    foot_length,
    pool_failures,
    rare_scatter,
)

# --- statistics -------------------------------------------------------------------------------


@pytest.mark.parametrize(('failures', 'trials'), [(0, 40), (3, 1000), (40, 40)])
def test_interval_is_that_of_clopper_and_pearson(failures, trials):
    """At either end so many failures, or so few, are one case in forty of the binomial law."""

    def law(rate):
        return [
            math.comb(trials, k) * rate**k * (1.0 - rate) ** (trials - k)
            for k in range(trials + 1)
        ]

    low, high = Rate(failures, trials).interval
    assert sum(law(low)[failures:]) == pytest.approx(0.025 if failures else 1.0, rel=1e-6)
    assert sum(law(high)[: failures + 1]) == pytest.approx(
        0.025 if failures < trials else 1.0, rel=1e-6
    )
    assert (low == 0.0, high == 1.0) == (failures == 0, failures == trials)


def test_fit_finds_the_curve_that_the_counts_were_drawn_from():
    law = Fragility(median=0.01, spread=0.5)
    random = np.random.default_rng(1)
    sigmas = [0.002, 0.003, 0.004, 0.006]
    rates = [Rate(int(random.binomial(20_000, law.rate(s))), 20_000) for s in sigmas]
    found = fit_fragility(sigmas, rates)
    assert found.sigma(1e-3) == pytest.approx(law.sigma(1e-3), rel=0.05)
    assert law.rate(law.sigma(1e-3)) == pytest.approx(1e-3, rel=1e-6)
    value, low, high = rare_scatter(sigmas, rates, repeats=40)
    assert low < value < high
    assert low < law.sigma(1e-3) < high


def test_what_fails_beyond_the_foot_does_not_bend_it():
    """Half of the element at another scatter: a step in the curve that no fragility has."""
    rates = [Rate(10, 10_000), Rate(100, 10_000), Rate(1500, 10_000), Rate(1600, 10_000)]
    sigmas = [1.0, 1.5, 2.2, 3.3]
    assert foot_length(rates) == 3
    assert fit_fragility(sigmas, rates) == fit_fragility(sigmas[:3], rates[:3])


def test_trials_that_fail_together_count_as_one():
    alike = pool_failures(elements=50, each=8, failures=5 * 8, squares=5 * 64)
    assert alike.clustering == pytest.approx(8.0, rel=0.05)
    assert alike.interval == pytest.approx(Rate(5, 50).interval, rel=0.05)
    random = np.random.default_rng(1)
    apart = random.binomial(8, 0.1, size=4000)
    rate = pool_failures(4000, 8, int(apart.sum()), int((apart**2).sum()))
    assert rate.clustering == pytest.approx(1.0, abs=0.05)


# --- where to count ---------------------------------------------------------------------------


@pytest.mark.parametrize('median', [2e-5, 3e-3, 0.2])
@pytest.mark.parametrize('spread', [0.05, 0.5])
def test_counting_finds_where_failures_begin_wherever_that_is(median, spread):
    law, random = Fragility(median, spread), np.random.default_rng(2)
    ladder = 1e-6 * 10.0 ** (np.arange(55) / 10)
    rates = {}
    while (rung := next_rung(rates, len(ladder), 4000)) is not None:
        more = 50 * math.ceil(count_missing_trials(rates.get(rung), 4000) / 50)
        failures = int(random.binomial(more, law.rate(ladder[rung])))
        before = rates.get(rung, Rate(0, 0))
        rates[rung] = Rate(before.failures + failures, before.trials + more)
    counted = [rung for rung, rate in rates.items() if rate.trials > 50]
    assert rates[min(counted)].value < RARE_RATE
    assert max(rate.value for rate in rates.values()) > 0.1
    assert sum(rate.trials for rate in rates.values()) < 5 * 4000
    assert law.rate(ladder[max(counted)]) < 0.9, 'no counting where all is known to fail'
