# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Tolerance: the statistics against known laws, and elements that chance has made."""

import dataclasses

import numpy as np
import pytest
from scipy.stats import binomtest

from mlmem_ros.cli.main import main
from mlmem_ros.device import Settings
from mlmem_ros.physics import CASE_II
from mlmem_ros.studies import campaign
from mlmem_ros.studies.tolerance import point
from mlmem_ros.studies.tolerance.estimate import ENOUGH, Fragility, Rate, fit, foot, rare_scatter
from mlmem_ros.studies.tolerance.study import Tolerance
from mlmem_ros.studies.tolerance.trial import Chance, chance, try_element

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


# --- elements ---------------------------------------------------------------------------------


def test_an_element_as_designed_does_all_it_should():
    trial = try_element(SHORT, Settings(), Chance(), seed=0)
    assert trial.stepped == (True,)
    assert trial.read == {'left': (0, 1), 'right': (0, 1)}


def test_coarse_cells_hold_the_wall_and_heavy_ones_hide_it():
    """A tenth in alpha outweighs the gradient; a fiftieth in mass echoes by itself."""
    held = [
        try_element(SHORT, Settings(), chance('alpha', 0.1), seed).stepped for seed in range(6)
    ]
    assert sum(stepped == (True,) for stepped in held) <= 3
    heard = [try_element(SHORT, Settings(), chance('mass', 0.02), seed).read for seed in range(6)]
    wrong = {end: sum(read[end] != (0, 1) for read in heard) for end in ('left', 'right')}
    assert wrong['left'] >= 4
    assert wrong['right'] <= 1


def test_the_seed_makes_the_element():
    scatter = chance('offset', 0.008)
    trials = [try_element(SHORT, Settings(), scatter, seed) for seed in (1, 1, 2, 3, 4, 5)]
    assert trials[0] == trials[1]
    assert len({trial.stepped for trial in trials}) == 2


def test_noise_silences_a_read_and_moves_no_wall():
    trial = try_element(SHORT, Settings(), chance('noise', 3e-3), seed=0)
    assert trial.stepped == (True,)
    assert trial.read == {'left': (-2, -2), 'right': (-2, -2)}


def test_a_base_that_shakes_moves_the_wall():
    """4e-4 at the wall's own frequency loses a level; here a sixth of 6e-3 is near it."""
    gentle = try_element(SHORT, Settings(), chance('vibration', 1e-5), seed=0)
    assert gentle.stepped == (True,)
    rough = [try_element(SHORT, Settings(), chance('vibration', 6e-3), s) for s in range(3)]
    assert not all(trial.stepped[0] for trial in rough)


# --- the study --------------------------------------------------------------------------------


CURVE = Fragility(median=0.004, spread=0.5)


def false_counts(shared, values, seed):
    """Count what a known curve lets fail: the study is tested, not the element."""
    random = np.random.default_rng(seed)
    rate = float(CURVE.rate(values['scatter']))
    counts = dict.fromkeys(point.columns(2), 0)
    counts['step_0'] = int(random.binomial(point.BATCH, rate))
    return {'elements': point.BATCH, **counts}


def counted(study, folder, rounds=None):
    with campaign.Ledger(folder / 'ledger.jsonl', study.campaign()) as ledger:
        for row in study.count(ledger, None):
            if rounds is not None and row['point'] >= rounds * len(study.cells):
                break
        return ledger.table()


def test_counting_stops_where_enough_has_failed_and_a_killed_study_goes_on(tmp_path, monkeypatch):
    monkeypatch.setattr('mlmem_ros.studies.tolerance.study.evaluate', false_counts)
    study = Tolerance(SHORT, Settings(), ('alpha',), amounts=5, most=400)
    whole, parts = tmp_path / 'whole', tmp_path / 'parts'
    whole.mkdir()
    parts.mkdir()
    rows = counted(study, whole)
    assert len(counted(study, parts, rounds=3)) < len(rows)
    assert counted(study, parts) == rows
    _, rates = study.curve(rows, 'alpha', 'step')
    assert rates[0].trials == 400, 'hardly anything fails: counted to the end'
    assert ENOUGH <= rates[-1].failures < ENOUGH + point.BATCH
    _, low, high = study.rare(rows, 'alpha', 'step')
    assert low < CURVE.sigma(1e-3) < high


def test_the_command_leaves_table_picture_and_ledger_and_a_batch_runs_alone(
    tmp_path, capsys, monkeypatch
):
    monkeypatch.setattr(point, 'BATCH', 2)  # elements, for speed
    monkeypatch.setattr('mlmem_ros.studies.tolerance.study.BATCH', 2)
    options = ['--kinds', 'mass', '--amounts', '2', '--most', '1', '--jobs', '1']
    output = ['--output', str(tmp_path / 'out')]
    assert main(['tolerance', *options, *output]) == 0
    assert 'one in a thousand' in capsys.readouterr().out
    names = {'batches.csv', 'ledger.jsonl', 'tolerance.png', 'tolerance.svg'}
    assert {path.name for path in (tmp_path / 'out').iterdir()} == names
    assert main(['tolerance', *options, *output, '--point', '1']) == 0
    assert main(['tolerance', *options, *output, '--point', '2']) != 0
    assert main(['tolerance', '--kinds', 'moisture']) == 2
    assert 'moisture' in capsys.readouterr().err
