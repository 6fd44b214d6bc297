# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Tolerance: the statistics against known laws, and elements that chance has made."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.stats import binomtest

from mlmem_ros.cli.main import main
from mlmem_ros.device import Settings
from mlmem_ros.physics import CASE_II, Scatter, scattered
from mlmem_ros.studies import campaign
from mlmem_ros.studies.tolerance import point
from mlmem_ros.studies.tolerance.estimate import (
    ENOUGH,
    RARE,
    Fragility,
    Rate,
    fit,
    foot,
    pooled,
    rare_scatter,
)
from mlmem_ros.studies.tolerance.forecast import Forecast
from mlmem_ros.studies.tolerance.screen import PROBABILITY, weights
from mlmem_ros.studies.tolerance.study import Tolerance
from mlmem_ros.studies.tolerance.trial import Chance, chance, outcomes
from mlmem_ros.studies.tolerance.walk import BEGIN, next_rung, trials_wanted

SHORT = dataclasses.replace(CASE_II, N=75)
"""Two levels: a step takes a third of the time."""


# --- statistics -------------------------------------------------------------------------------


@pytest.mark.parametrize(('failures', 'trials'), [(0, 40), (3, 1000), (40, 40)])
def test_the_interval_is_that_of_clopper_and_pearson(failures, trials):
    expected = binomtest(failures, trials).proportion_ci(0.95, method='exact')
    assert Rate(failures, trials).interval == pytest.approx((expected.low, expected.high))


def test_the_fit_finds_the_curve_that_the_counts_were_drawn_from():
    law = Fragility(median=0.01, spread=0.5)
    random = np.random.default_rng(1)
    sigmas = [0.002, 0.003, 0.004, 0.006]
    rates = [Rate(int(random.binomial(20_000, law.rate(s))), 20_000) for s in sigmas]
    found = fit(sigmas, rates)
    assert found.sigma(1e-3) == pytest.approx(law.sigma(1e-3), rel=0.05)
    assert law.rate(law.sigma(1e-3)) == pytest.approx(1e-3, rel=1e-6)
    value, low, high = rare_scatter(sigmas, rates, repeats=40)
    assert low < value < high
    assert low < law.sigma(1e-3) < high


def test_what_fails_beyond_the_foot_does_not_bend_it():
    """Half of the element at another scatter: a step in the curve that no fragility has."""
    rates = [Rate(10, 10_000), Rate(100, 10_000), Rate(1500, 10_000), Rate(1600, 10_000)]
    sigmas = [1.0, 1.5, 2.2, 3.3]
    assert foot(rates) == 3
    assert fit(sigmas, rates) == fit(sigmas[:3], rates[:3])


def test_counts_that_tell_no_curve_give_none():
    assert fit([0.1, 0.2], [Rate(0, 100), Rate(3, 100)]) is None
    assert rare_scatter([0.1, 0.2], [Rate(0, 100), Rate(100, 100)]) is None


def test_trials_that_fail_together_count_as_one():
    alike = pooled(elements=50, each=8, failures=5 * 8, squares=5 * 64)
    assert alike.clustering == pytest.approx(8.0, rel=0.05)
    assert alike.interval == pytest.approx(Rate(5, 50).interval, rel=0.05)
    random = np.random.default_rng(1)
    apart = random.binomial(8, 0.1, size=4000)
    rate = pooled(4000, 8, int(apart.sum()), int((apart**2).sum()))
    assert rate.clustering == pytest.approx(1.0, abs=0.05)


# --- where to count ---------------------------------------------------------------------------


@pytest.mark.parametrize('median', [2e-5, 3e-3, 0.2])
@pytest.mark.parametrize('spread', [0.05, 0.5])
def test_counting_finds_where_failures_begin_wherever_that_is(median, spread):
    law, random = Fragility(median, spread), np.random.default_rng(2)
    ladder = 1e-6 * 10.0 ** (np.arange(55) / 10)
    rates = {}
    while (rung := next_rung(rates, len(ladder), 4000)) is not None:
        more = 50 * math.ceil(trials_wanted(rates.get(rung), 4000) / 50)
        failures = int(random.binomial(more, law.rate(ladder[rung])))
        before = rates.get(rung, Rate(0, 0))
        rates[rung] = Rate(before.failures + failures, before.trials + more)
    counted = [rung for rung, rate in rates.items() if rate.trials > 50]
    assert rates[min(counted)].value < RARE
    assert max(rate.value for rate in rates.values()) > BEGIN
    assert sum(rate.trials for rate in rates.values()) < 5 * 4000
    assert law.rate(ladder[max(counted)]) < 0.9, 'no counting where all is known to fail'


def test_where_nothing_fails_the_greatest_amount_alone_is_counted():
    rates = {}
    while (rung := next_rung(rates, 40, 500)) is not None:
        before = rates.get(rung, Rate(0, 0))
        rates[rung] = Rate(0, before.trials + 50)
    assert [rung for rung, rate in rates.items() if rate.trials == 500] == [39]


# --- elements ---------------------------------------------------------------------------------


def tried(by, seed, what):
    return outcomes(SHORT, Settings(), by, seed, what)


def test_an_element_as_designed_does_all_it_should():
    assert tried(Chance(), 0, 'step') == (1,)
    assert tried(Chance(), 0, 'left') == tried(Chance(), 0, 'right') == (0, 1)


def test_coarse_cells_hold_the_wall_and_heavy_ones_hide_it():
    """A tenth in alpha outweighs the gradient; a fiftieth in mass echoes by itself."""
    held = [tried(chance('alpha', 0.1), seed, 'step') for seed in range(6)]
    assert sum(level == (1,) for level in held) <= 3
    wrong = {
        end: sum(tried(chance('mass', 0.02), seed, end) != (0, 1) for seed in range(6))
        for end in ('left', 'right')
    }
    assert wrong['left'] >= 4
    assert wrong['right'] <= 1


def test_the_seed_makes_the_element():
    found = [tried(chance('offset', 0.008), seed, 'step') for seed in (1, 1, 2, 3, 4, 5)]
    assert found[0] == found[1]
    assert len(set(found)) >= 2


def test_noise_silences_a_read_and_moves_no_wall():
    assert tried(chance('noise', 3e-3), 0, 'step') == (1,)
    assert tried(chance('noise', 3e-3), 0, 'left') == (-2, -2)
    assert tried(chance('noise', 3e-3), 0, 'right') == (-2, -2)


def test_a_base_that_shakes_moves_the_wall():
    """4e-4 at the wall's own frequency loses a level; here a sixth of 6e-3 is near it."""
    assert tried(chance('vibration', 1e-5), 0, 'step') == (1,)
    rough = [tried(chance('vibration', 6e-3), seed, 'step') for seed in range(3)]
    assert any(level != (1,) for level in rough)


# --- forecast and screen ----------------------------------------------------------------------


@pytest.mark.parametrize(('kind', 'amount'), [('alpha', 8e-4), ('offset', 2.5e-4), ('s', 0.2)])
def test_the_forecast_is_mostly_right_where_half_of_all_steps_fail(kind, amount):
    forecast, by = Forecast(SHORT, Settings()), chance(kind, amount)
    right = failed = 0
    for seed in range(30):
        fails = tried(by, seed, 'step') != (1,)
        foreseen = forecast.failing(scattered(SHORT, by.scatter, seed), 0, (1.0,)) == 1.0
        right += fails == foreseen
        failed += fails
    assert 5 <= failed <= 25
    assert right >= 24


def test_a_screen_counts_every_step_once_in_the_mean():
    class Known:
        def failing(self, specimen, level, inflations):
            return list(PROBABILITY)[level]

    specimen = scattered(SHORT, Scatter(), 0)
    found = np.array([weights(Known(), specimen, len(PROBABILITY), s) for s in range(4000)])
    assert found.mean(axis=0) == pytest.approx(1.0, abs=0.3)
    assert (found > 0.0).mean(axis=0) == pytest.approx(list(PROBABILITY.values()), abs=0.03)


@pytest.mark.slow
@pytest.mark.parametrize(('kind', 'amount'), [('alpha', 1.5e-4), ('offset', 5e-5)])
def test_screened_and_plain_counting_agree(kind, amount):
    found = {}
    for screen, points in ((False, 25), (True, 5)):
        study = Tolerance(SHORT, Settings(), (kind,), ('step',), screen=screen)
        values = {'kind': kind, 'tried': 'step', 'scatter': amount}
        rows = [
            values | point.evaluate(study.shared, values, seed) for seed in range(points)
        ]  # fmt: skip
        found[screen] = study.rate(rows), sum(row['simulated'] for row in rows)
    (plain, _), (screened, simulated) = found[False], found[True]
    assert plain.failures > 5
    low, high = screened.interval
    assert low < plain.interval[1]
    assert plain.interval[0] < high
    assert simulated < screened.trials / 5


# --- the study --------------------------------------------------------------------------------


CURVE = Fragility(median=0.004, spread=0.5)


def false_counts(shared, values, seed):
    """Count what a known curve lets fail: the study is tested, not the element."""
    random = np.random.default_rng(seed)
    failed = int(random.binomial(32, float(CURVE.rate(values['scatter']))))
    counts = {'elements': 32, 'simulated': 32, 'squares': failed, 'silent': 0}
    return counts | {'failed_0': failed, 'failed_1': 0}


def counted(study, folder, points=None):
    with campaign.Ledger(folder / 'ledger.jsonl', study.campaign()) as ledger:
        for number, _ in enumerate(study.count(ledger, None)):
            if number == points:
                break
        return ledger.table()


def test_counting_stops_where_enough_has_failed_and_a_killed_study_goes_on(tmp_path, monkeypatch):
    monkeypatch.setattr('mlmem_ros.studies.tolerance.study.evaluate', false_counts)
    study = Tolerance(SHORT, Settings(), ('alpha',), ('step',), most=4000)
    whole, parts = tmp_path / 'whole', tmp_path / 'parts'
    whole.mkdir()
    parts.mkdir()
    rows = counted(study, whole)
    assert len(counted(study, parts, points=33)) < len(rows)
    assert counted(study, parts) == rows
    amounts, rates = study.rates(rows, 'alpha', 'step')
    assert any(rate.trials >= 4000 for rate in rates), 'hardly anything fails: to the end'
    assert all(rate.failures < ENOUGH + 32 for rate in rates), 'much fails: no longer than needed'
    assert amounts[0] < CURVE.sigma(RARE) < amounts[-1]
    _, low, high = study.rare(rows, 'alpha', 'step')
    assert low < CURVE.sigma(1e-3) < high


def test_an_instrument_that_reads_from_one_end_is_tried_there_alone():
    settings = Settings()
    right = dataclasses.replace(settings, read=dataclasses.replace(settings.read, end='right'))
    assert Tolerance(SHORT, right).tried == ('step', 'right')
    with pytest.raises(ValueError, match='left'):
        Tolerance(SHORT, right, tried=('left',))


def test_the_command_leaves_table_picture_and_ledger_and_a_batch_runs_alone(
    tmp_path, capsys, monkeypatch
):
    monkeypatch.setattr('mlmem_ros.studies.tolerance.study.evaluate', false_counts)
    options = ['--kinds', 'mass', '--tried', 'step', 'right', '--jobs', '1', '--most', '200']
    folder = tmp_path / 'out'
    assert main(['tolerance', *options, '--design', 'bits_1', '--output', str(folder)]) == 0
    assert 'one in a thousand' in capsys.readouterr().out
    names = {'batches.csv', 'ledger.jsonl', 'tolerance.png', 'tolerance.svg'}
    assert {path.name for path in folder.iterdir()} == names
    assert main(['tolerance', '--compare', str(folder), '--output', str(tmp_path / 'both')]) == 0
    assert 'step up' in (tmp_path / 'both' / 'comparison.md').read_text()
    monkeypatch.setattr(point, 'BATCH', 4)  # levels, for speed
    assert main(['tolerance', *options, '--design', 'bits_1', '--point', '1']) == 0
    assert main(['tolerance', *options, '--design', 'bits_1', '--point', '999999']) != 0
    assert main(['tolerance', '--kinds', 'moisture']) == 2
    assert main(['tolerance', '--compare', str(tmp_path / 'nowhere')]) == 1
    assert 'moisture' in capsys.readouterr().err
