# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Tolerance: random elements, the forecast, and the study."""

import dataclasses
import json
import re
from functools import partial

import numpy as np
import pytest
from sampled import sampled
from small_register import first_levels

from mlmem import UNDECODABLE, Settings, preset
from mlmem.move_settings import KickSettings
from mlmem.physics import CASE_II, Design, Scatter, scattered
from mlmem.presets import load_preset
from mlmem_lab.studies import campaign
from mlmem_lab.studies.style import style_context
from mlmem_lab.studies.tolerance import element
from mlmem_lab.studies.tolerance import study as studied
from mlmem_lab.studies.tolerance.draw import draw_rates
from mlmem_lab.studies.tolerance.element import Chance, single_chance, try_element
from mlmem_lab.studies.tolerance.estimate import (
    ENOUGH_FAILURES,
    RARE_RATE,
    Fragility,
    fit_fragility,
    rare_scatter,
)
from mlmem_lab.studies.tolerance.particle import SIMULATION_PROBABILITY, StepForecast, draw_weights
from mlmem_lab.studies.tolerance.study import Tolerance
from mlmem_tools.cli.main import main

SHORT = dataclasses.replace(CASE_II, N=75)
"""Two levels: a step takes a third of the time."""


# --- elements ---------------------------------------------------------------------------------


def tried(by, seed, what):
    return try_element(SHORT, Settings(), by, seed, what)


def test_kicks_are_tried_from_blank_where_every_level_has_one():
    design, settings = preset('kick_2')
    assert try_element(design, settings, Chance(), 0, 'kick') == (0, 1, 2, 3)
    lost = try_element(design, settings, single_chance('alpha', 0.1), 0, 'kick')
    assert lost != (0, 1, 2, 3)  # a well of its own in every cell stops walls anywhere
    with pytest.raises(ValueError, match='tried can be kick only where every level has one'):
        Tolerance(
            design, dataclasses.replace(settings, kick=KickSettings()), ('alpha',), ('kick',)
        )


def test_words_are_kicked_and_heard_and_say_how_they_fail(monkeypatch):
    """Springs of a hundredth stop walls anywhere, and let them meet; a twentieth of the gain is
    more than tells two words apart.
    """
    design, settings = first_levels(4)
    words = (0b0111, 0b1000)
    for what in ('word', 'hear', 'blind'):
        assert try_element(design, settings, Chance(), 0, what, words) == words
    assert (
        try_element(design, settings, single_chance('gain', 0.2), 0, 'hear', words)
        == (UNDECODABLE,) * 2
    )
    monkeypatch.setattr(element, 'BATCH_LEVELS', 16)  # words, for speed
    study = Tolerance(design, settings, ('k_r',), ('word',))
    values = {'kind': 'k_r', 'tried': 'word', 'scatter': 0.01}
    row = values | element.evaluate_point(study.shared, values, 1)
    (how,) = study.how([row], 'k_r', 'word')
    assert how['tried'] == row['tried_0'] == 16
    assert how['short'] > 0
    assert how['annihilated'] > 0
    assert sum(how[name] for name in element.ASTRAY_NAMES.values()) == row['failed_0'] > 8
    with pytest.raises(ValueError, match='tried can be word, hear, blind only in a register'):
        Tolerance(*preset('kick_2'), ('alpha',), ('word',))


def test_a_word_that_is_read_as_another_has_lost_a_pair_of_walls_or_not(monkeypatch):
    """Half of the words are undecodable; of the others two walls are gone, if there are two."""
    lost = []

    def false_outcomes(design, settings, by, seed, what, words):
        some = [[level for level in range(8) if word >> level & 1] for word in words[::2]]
        lost.extend(len(levels) > 1 for levels in some)
        left = [sum(1 << level for level in levels[2:]) for levels in some]
        return tuple(read for one in left for read in (one, UNDECODABLE))

    monkeypatch.setattr(element, 'try_element', false_outcomes)
    study = Tolerance(*preset('byte'), ('alpha',), ('blind',))
    values = {'kind': 'alpha', 'tried': 'blind', 'scatter': 0.001}
    row = values | element.evaluate_point(study.shared, values, 1)
    (how,) = study.how([row], 'alpha', 'blind')
    assert how['undecodable'] == how['silent'] == 32
    assert how['paired'] == sum(lost) > 20
    assert 0.0 < how['bits'] < 0.01, 'all that is known is which word it was not'


@pytest.mark.parametrize(
    ('shift', 'how'), [((0, 0), 0), ((0, 9), -3), ((4, -3), -4), ((0,), -6), ((), -5)]
)
def test_a_word_is_astray_by_the_first_wall_that_was_sent_wrong(shift, how):
    """Walls belong to the levels 2 and 7; the one at 7 was sent first."""
    places = [CASE_II.defect_site(level) + 0.3 for level in (2, 7)]
    found = [place + by for place, by in zip(places, shift, strict=False)]
    assert element.count_astray(CASE_II, found, (2, 7)) == how


def test_an_element_as_designed_does_all_it_should():
    assert tried(Chance(), 0, 'step') == (1,)
    assert tried(Chance(), 0, 'left') == tried(Chance(), 0, 'right') == (0, 1)


def test_coarse_cells_hold_the_wall_and_heavy_ones_hide_it():
    """A tenth in alpha outweighs the gradient; a fiftieth in mass echoes by itself.

    The left end hears these echoes, and no level is told that it does not confirm.
    """
    held = [tried(single_chance('alpha', 0.1), seed, 'step') for seed in range(6)]
    assert sum(level == (1,) for level in held) <= 3
    wrong = {
        end: sum(tried(single_chance('mass', 0.02), seed, end) != (0, 1) for seed in range(6))
        for end in ('left', 'right')
    }
    assert wrong['left'] >= 4
    assert wrong['right'] >= 4


def test_the_seed_makes_the_element():
    found = [tried(single_chance('offset', 0.008), seed, 'step') for seed in (1, 1, 2, 3, 4, 5)]
    assert found[0] == found[1]
    assert len(set(found)) >= 2


def test_noise_silences_a_read_and_moves_no_wall():
    assert tried(single_chance('noise', 3e-3), 0, 'step') == (1,)
    assert tried(single_chance('noise', 3e-3), 0, 'left') == (-2, -2)
    assert tried(single_chance('noise', 3e-3), 0, 'right') == (-2, -2)


def test_a_base_that_shakes_moves_the_wall():
    """4e-4 at the wall's own frequency loses a level; here a sixth of 6e-3 is near it."""
    assert tried(single_chance('vibration', 1e-5), 0, 'step') == (1,)
    rough = [tried(single_chance('vibration', 6e-3), seed, 'step') for seed in range(3)]
    assert any(level != (1,) for level in rough)


# --- forecast and screen ----------------------------------------------------------------------


@pytest.mark.parametrize(
    ('kind', 'amount'),
    sampled([('alpha', 8e-4), ('s', 0.2), ('offset', 2.5e-4)], lambda each: each[0] != 'offset'),
)
def test_the_forecast_is_mostly_right_where_half_of_all_steps_fail(kind, amount):
    forecast, by = StepForecast(SHORT, Settings()), single_chance(kind, amount)
    right = failed = 0
    for seed in range(12):
        fails = tried(by, seed, 'step') != (1,)
        foreseen = forecast.failing(scattered(SHORT, by.scatter, seed), 0, (1.0,)) == 1.0
        right += fails == foreseen
        failed += fails
    assert 3 <= failed <= 9
    assert right >= 10


def test_a_screen_counts_every_step_once_in_the_mean():
    class Known:
        def failing(self, specimen, level, inflations):
            return list(SIMULATION_PROBABILITY)[level]

    specimen = scattered(SHORT, Scatter(), 0)
    found = np.array(
        [
            draw_weights(Known(), specimen, range(len(SIMULATION_PROBABILITY)), s)
            for s in range(4000)
        ]
    )
    assert found.mean(axis=0) == pytest.approx(1.0, abs=0.3)
    assert (found > 0.0).mean(axis=0) == pytest.approx(
        list(SIMULATION_PROBABILITY.values()), abs=0.03
    )


@pytest.mark.slow
@pytest.mark.parametrize(('kind', 'amount'), [('alpha', 1.5e-4), ('offset', 5e-5)])
def test_screened_and_plain_counting_agree(kind, amount):
    found = {}
    for screen, points in ((False, 25), (True, 5)):
        study = Tolerance(SHORT, Settings(), (kind,), ('step',), screen=screen)
        values = {'kind': kind, 'tried': 'step', 'scatter': amount}
        rows = [
            values | element.evaluate_point(study.shared, values, seed) for seed in range(points)
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
    """Draw counts from a known curve: the study is tested, not the element."""
    elements, _ = element.batch_size(shared, values['kind'], values['tried'])
    random = np.random.default_rng(seed)
    failed = int(random.binomial(elements, float(CURVE.rate(values['scatter']))))
    counts = {'elements': elements, 'simulated': elements, 'squares': failed, 'silent': 0}
    return counts | {'tried_0': elements, 'failed_0': failed}


@pytest.fixture
def false(monkeypatch):
    """Counts from a known curve, and intervals of 40 draws."""
    monkeypatch.setattr(studied, 'evaluate_point', false_counts)
    monkeypatch.setattr(studied, 'rare_scatter', partial(rare_scatter, repeats=40))


def counted(study, folder, points=None):
    with campaign.Ledger(folder / 'ledger.jsonl', study.campaign()) as ledger:
        for number, _ in enumerate(study.count(ledger, None)):
            if number == points:
                break
        return ledger.table()


def test_counting_stops_when_enough_has_failed_and_a_killed_study_continues(tmp_path, false):
    study = Tolerance(SHORT, Settings(), ('alpha',), ('step',), most=4000)
    whole, parts = tmp_path / 'whole', tmp_path / 'parts'
    whole.mkdir()
    parts.mkdir()
    rows = counted(study, whole)
    assert len(counted(study, parts, points=33)) < len(rows)
    assert counted(study, parts) == rows
    amounts, rates = study.rates(rows, 'alpha', 'step')
    assert any(rate.trials >= 4000 for rate in rates), 'hardly anything fails: to the end'
    assert all(rate.failures < ENOUGH_FAILURES + element.BATCH_LEVELS for rate in rates), (
        'much fails: no longer than needed'
    )
    assert amounts[0] < CURVE.sigma(RARE_RATE) < amounts[-1]
    (_, low, high), text = study.rare_amount(rows, 'alpha', 'step')
    assert f'({low:.2g} to {high:.2g})' in text
    assert low < CURVE.sigma(1e-3) < high


def test_a_sample_of_levels_counts_as_all_of_them_do(monkeypatch):
    """Levels are drawn anew for each element, whatever fails."""
    rate = np.linspace(0.0, 0.6, 16)
    bits_4 = preset('bits_4').design

    def false_outcomes(design, settings, by, seed, what, levels):
        lost = np.random.default_rng(seed).random(design.levels) < rate
        return tuple(UNDECODABLE if lost[level] else level for level in levels)

    known = {Design: bits_4, Settings: Settings()}
    monkeypatch.setattr(element, 'decode_value', lambda kind, _: known[kind])  # 300 times the same
    monkeypatch.setattr(element, 'try_element', false_outcomes)
    values = {'kind': 'mass', 'tried': 'right', 'scatter': 0.01}
    found = {}
    for levels in (0, 3):
        study = Tolerance(bits_4, Settings(), ('mass',), ('right',), levels=levels)
        rows = [values | element.evaluate_point(study.shared, values, seed) for seed in range(150)]
        found[levels] = study.rate(rows), rows
    (whole, _), (drawn, rows) = found[0], found[3]
    tried, failed = (
        np.array([sum(row[f'{what}_{level}'] for row in rows) for level in range(16)])
        for what in ('tried', 'failed')
    )
    assert whole.trials == 150 * 64
    assert drawn.trials == 150 * 21 * 3
    assert tried.sum() == drawn.trials
    assert len(set(tried)) > 1, 'drawn by chance'
    assert failed.sum() == drawn.failures
    assert drawn.value == pytest.approx(rate.mean(), rel=0.05)
    assert failed / tried == pytest.approx(rate, abs=0.07)
    assert drawn.clustering == pytest.approx(1.0, abs=0.1)


def test_a_level_gives_the_same_result_in_a_sample_as_among_all(monkeypatch):
    monkeypatch.setattr(element, 'BATCH_LEVELS', 8)
    design, settings = load_preset('bits_2')
    shared = Tolerance(design, settings, levels=1).shared
    values = {'kind': 'mass', 'tried': 'right', 'scatter': 0.02}
    drawn = list(element.try_elements(shared, values, seed=5))
    assert len(drawn) == 8
    assert len({int(one.levels[0]) for one in drawn}) > 2
    assert 0 < sum(int(one.wrong[0]) for one in drawn) < 8
    for one in drawn:
        every = try_element(design, settings, single_chance('mass', 0.02), one.seed, 'right')
        assert one.found[0] == every[one.levels[0]]


def test_another_sample_is_another_study(tmp_path, false):
    counted(Tolerance(CASE_II, Settings(), ('alpha',), ('step',), levels=1), tmp_path, points=1)
    with pytest.raises(campaign.CampaignError, match='another common'):
        counted(Tolerance(CASE_II, Settings(), ('alpha',), ('step',), levels=2), tmp_path)
    with pytest.raises(ValueError, match='levels'):
        Tolerance(CASE_II, Settings(), levels=-1)


def test_the_command_leaves_table_picture_and_ledger_and_a_batch_runs_alone(
    tmp_path, capsys, monkeypatch, false, sketched
):
    options = ['--kinds', 'mass', '--tried', 'step', 'right', '--jobs', '1', '--most', '200']
    folder = tmp_path / 'out'
    said = [*options, '--design', 'bits_1', '--output', str(folder), '--json']
    assert main(['tolerance', *said]) == 0
    rare = json.loads(capsys.readouterr().out)['one_in_a_thousand']
    assert set(rare) == {'mass'}
    assert set(rare['mass']) == {'step', 'right'}
    text = rare['mass']['step']['text']
    assert re.fullmatch(r'none of \d+ at [\d.e-]+, 0\.\d+ of all at [\d.e-]+', text)
    names = {'batches.csv', 'ledger.jsonl', 'tolerance.png', 'tolerance.svg'}
    assert {path.name for path in folder.iterdir()} == names
    monkeypatch.setattr(element, 'BATCH_LEVELS', 4)  # levels, for speed
    assert main(['tolerance', *options, '--design', 'bits_1', '--point', '1']) == 0
    assert main(['tolerance', *options, '--design', 'bits_1', '--point', '999999']) != 0
    assert main(['tolerance', '--kinds', 'moisture']) == 2
    assert 'moisture' in capsys.readouterr().err


def test_a_curve_has_its_name_and_a_mark_where_one_in_a_thousand_fails(tmp_path, false):
    study = Tolerance(SHORT, Settings(), ('alpha', 'mass'), ('step', 'right'), most=1000)
    rows = counted(study, tmp_path)
    with style_context():
        upper, lower = draw_rates(study, rows).axes
    for axes, tried in ((upper, 'step'), (lower, 'right')):
        assert [text.get_text() for text in axes.texts] == ['alpha', 'mass']
        marks = [float(line.get_xdata()[0]) for line in axes.lines if line.get_marker() == 'v']
        curves = [fit_fragility(*study.rates(rows, kind, tried)) for kind in study.kinds]
        assert marks == [curve.sigma(RARE_RATE) for curve in curves]
