# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Tolerance: what random elements do, a study of them, and its statistics against known laws."""

import dataclasses
import json
import math
from functools import partial

import numpy as np
import pytest
from rig import first_levels

from mlmem import UNDECODABLE, Settings, load_element
from mlmem.physics import CASE_II
from mlmem_lab.results import load_result
from mlmem_lab.studies.tolerance import curve, element
from mlmem_lab.studies.tolerance.curve import count_curve, describe_rare_amount, list_rates
from mlmem_lab.studies.tolerance.element import evaluate_batch, try_element
from mlmem_lab.studies.tolerance.estimate import (
    ENOUGH_FAILURES,
    RARE_RATE,
    Fragility,
    Rate,
    fit_fragility,
    foot_length,
    pool_failures,
    rare_scatter,
)
from mlmem_lab.studies.tolerance.study import list_cases
from mlmem_tools.cli.main import main

SHORT = dataclasses.replace(CASE_II, N=75)
"""Two levels: a step takes a third of the time."""


# --- elements ---------------------------------------------------------------------------------


def try_short(by, seed, what):
    given = (0,) if what == 'step' else (0, 1)
    return try_element(SHORT, Settings(), by, seed, what, given)


def test_kicks_from_blank_reach_every_level():
    design, settings = load_element('kick_2').design_and_settings
    levels = (0, 1, 2, 3)
    assert try_element(design, settings, {}, 0, 'kick', levels) == levels
    lost = try_element(design, settings, {'alpha': 0.1}, 0, 'kick', levels)
    assert lost != levels  # a well of its own in every cell stops walls anywhere
    with pytest.raises(ValueError, match='tried can be kick only where every level has one'):
        list_cases('bits_4', ('alpha',), ('kick',), 10)


def test_tried_words_are_kicked_and_read():
    """Scatter of a hundredth in the springs stops walls anywhere, and lets them meet. A fifth of
    the gain is more than tells two words apart.
    """
    design, settings = first_levels('byte', 4).design_and_settings
    words = (0b0111, 0b1000)
    for what in ('word', 'hear'):
        assert try_element(design, settings, {}, 0, what, words) == words
    loud = try_element(design, settings, {'gain': 0.2}, 0, 'hear', words)
    assert loud == (UNDECODABLE,) * 2
    assert try_element(design, settings, {'k_r': 0.01}, 0, 'word', words) != words
    with pytest.raises(ValueError, match='tried can be word, hear only in a register'):
        list_cases('kick_2', ('alpha',), ('word',), 10)


def test_coarse_cells_hold_the_wall_and_heavy_ones_hide_it():
    """A tenth in alpha outweighs the gradient; a fiftieth in mass echoes by itself.

    The left end hears these echoes, and no level is told that it does not confirm.
    """
    held = [try_short({'alpha': 0.1}, seed, 'step') for seed in range(6)]
    assert sum(level == (1,) for level in held) <= 3
    for end in ('left', 'right'):
        heavy = [try_short({'mass': 0.02}, seed, end) for seed in range(6)]
        assert sum(levels != (0, 1) for levels in heavy) >= 4


def test_tried_element_depends_on_its_seed():
    by = {'offset': 0.008}
    found = [try_short(by, seed, 'step') for seed in (1, 1, 2, 3, 4, 5)]
    assert found[0] == found[1]
    assert len(set(found)) >= 2


def test_batch_counts_its_elements(monkeypatch):
    """Of 32 elements every second one fails at both of its levels, once by another level."""
    outcomes = iter([(0, 1), (1, UNDECODABLE)] * 16)
    monkeypatch.setattr(element, 'try_element', lambda *_: next(outcomes))
    assert evaluate_batch(SHORT, Settings(), 'mass', 'right', 0.02, seed=5) == {
        'elements': 32, 'trials': 64, 'failures': 32, 'squares': 64,
    }  # fmt: skip


# --- the study --------------------------------------------------------------------------------


@pytest.fixture
def law(request, monkeypatch):
    """The curve from which counts are drawn: the study is tested, not the element. Intervals are
    of 40 draws.
    """
    law = getattr(request, 'param', Fragility(median=0.004, spread=0.5))

    def draw_counts(design, settings, kind, tried, amount, seed):
        failed = int(np.random.default_rng(seed).binomial(64, float(law.rate(amount))))
        return {'elements': 64, 'trials': 64, 'failures': failed, 'squares': failed}

    monkeypatch.setattr(curve, 'evaluate_batch', draw_counts)
    monkeypatch.setattr(curve, 'rare_scatter', partial(rare_scatter, repeats=40))
    return law


@pytest.mark.parametrize(
    'law',
    [Fragility(median, spread) for median in (2e-5, 4e-3, 0.2) for spread in (0.05, 0.5)],
    indirect=True,
)
def test_curve_is_counted_until_enough_has_failed(law):
    """Wherever failures begin; not where all is known to fail."""
    amounts, rates = list_rates(count_curve(SHORT, Settings(), 'alpha', 'step', 4000))
    assert any(rate.trials >= 4000 for rate in rates), 'hardly anything fails: to the end'
    assert all(rate.failures < ENOUGH_FAILURES + 64 for rate in rates), 'no longer than needed'
    assert sum(rate.trials for rate in rates) < 5 * 4000
    assert amounts[0] < law.sigma(RARE_RATE) < amounts[-1]
    assert max(rate.value for rate in rates) > 0.1
    counted = [amount for amount, rate in zip(amounts, rates, strict=True) if rate.trials > 64]
    assert law.rate(counted[-1]) < 0.9


def test_rare_amount_is_stated_with_its_interval(law):
    rows = count_curve(SHORT, Settings(), 'alpha', 'step', 4000)
    (_, low, high), text = describe_rare_amount(rows)
    assert f'({low:.2g} to {high:.2g})' in text
    assert low < law.sigma(1e-3) < high


def test_tolerance_command_keeps_curves_and_goes_on(tmp_path, capsys, law):
    file, picture = tmp_path / 'out' / 'bits_1.json', tmp_path / 'rates.png'
    options = ['tolerance', '--design', 'bits_1', '--output', str(file), '--jobs', '1', '--json']
    options += ['--most', '200', '--kinds', 'mass', '--tried']
    assert main([*options, 'step']) == 0
    capsys.readouterr()
    first = load_result(file)['cases']
    assert list(first) == ['bits_1 mass step 200']
    assert main([*options, 'step', 'right', '--figure', str(picture)]) == 0
    both = load_result(file)['cases']
    assert both == first | {'bits_1 mass right 200': both['bits_1 mass right 200']}
    assert picture.exists()
    rare = json.loads(capsys.readouterr().out)['one_in_a_thousand']
    assert rare.keys() == both.keys()
    assert main(['tolerance', '--kinds', 'alpha+moisture']) == 2
    assert 'got moisture' in capsys.readouterr().err


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
