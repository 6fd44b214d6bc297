# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Studies in small: reads in a row, shaken elements, plans of kicks, limits of the model, standard
problems, what fits and twins are worth.
"""

import itertools
from collections import Counter
from copy import deepcopy
from functools import cache, partial
from types import SimpleNamespace

import numpy as np
import pytest
from rig import first_levels

from mlmem import MemoryElement, Settings, Write, memory
from mlmem.element_file import Element
from mlmem.errors import ProcedureFailed
from mlmem.instrument.drivers import Simulation
from mlmem.physics import CASE_II, Scatter, draw_specimen
from mlmem.readers.register import forecast_words
from mlmem.readers.waveform_reader import WaveformReader
from mlmem_lab import validity
from mlmem_lab.reads import count
from mlmem_lab.reads.count import count_rows, describe_counts, sum_presets, true_level
from mlmem_lab.rk4 import Rk4Element
from mlmem_lab.shaken import Shaking, count_block
from mlmem_lab.standard_problems import ALL_PROBLEMS
from mlmem_lab.standard_problems.problem import ANSWERS_FILE, read_answers
from mlmem_lab.twins import surveyed, watched
from mlmem_lab.twins.study import watch_elements
from mlmem_tools.identification import plan
from mlmem_tools.identification.plan import plan_pulses


@pytest.fixture
def few_reads(monkeypatch):
    """Read four times after every move."""
    monkeypatch.setattr(count, 'READS_PER_MOVE', 4)


@pytest.mark.parametrize('finer', [1, 2])
def test_every_read_is_counted_after_every_kind_of_move(finer, few_reads):
    counts = count_rows('bits_1', 4, seed=1, finer=finer)
    assert counts['rows'] == 4
    assert describe_counts(counts)['reads'] == counts['right'] == 16
    assert counts['written'] == 2  # the write, and that after the erase
    assert not describe_counts(counts)['reasons']


def test_proof_catches_a_device_that_lies(monkeypatch, few_reads):
    """Walls are one level beside the place that the device is right about."""
    monkeypatch.setattr(count, 'true_level', lambda element: 1 - true_level(element))
    counts = count_rows('bits_1', 4, seed=1)
    assert counts['wrong'] == 16
    assert counts['wrong rows'] == counts['rows'] == 4
    assert counts['written wrong'] == 2
    assert any(reason.startswith('WRONG: ') for reason in counts)
    assert describe_counts(counts)['wrong rows, at most (95 %)'] == 1.0


def test_counts_of_all_elements_are_summed():
    def counts(right):
        return describe_counts(Counter(right=right, rows=1))

    found = sum_presets({
        'bits_1': {'ideal': counts(1), 'scattered': counts(2)},
        'bits_2': {'ideal': counts(4), 'scattered': counts(8)},
    })  # fmt: skip
    assert [found[kind]['reads'] for kind in ('ideal', 'scattered', 'all')] == [5, 10, 15]


def test_imu_of_200_hz_sends_every_two_and_a_half_ticks():
    course = Shaking('white', 1.0).generate_course(seed=1, tick=2e-3)
    accelerations = np.array(list(itertools.islice(course, 10_000)))
    assert len(np.unique(accelerations)) == pytest.approx(4000, abs=1)
    assert np.abs(accelerations).max() == pytest.approx(9.81, rel=1e-3)
    assert accelerations.std() == pytest.approx(9.81 / 3**0.5, rel=0.03)


def test_shaken_count_repeats_to_the_bit():
    shaking = Shaking('white', 1.5)
    first, again = (
        count_block(CASE_II, Settings(), shaking, 'left', 7, 2, seed=5) for _ in range(2)
    )
    assert (first['reads'], first['wrong'], first['undecodable']) == (2, 0, 0)
    assert first == again


def test_wall_that_was_shaken_off_is_not_counted():
    counts = count_block(CASE_II, Settings(), Shaking('sine', 400.0, 16.0), 'left', 3, 1, seed=1)
    assert (counts['reads'], counts['moved']) == (0, 1)


def test_register_is_kicked_as_planned_for_its_cells(monkeypatch):
    """Alpha scattered by 1 %. With its own forecasts, but kicks as shipped, it writes 2 of 8
    words. The plan tries every third speed.
    """
    monkeypatch.setattr(plan, 'KICK_SPEEDS', plan.KICK_SPEEDS[::3])
    chosen = first_levels('byte', 3)
    design, settings = chosen.design_and_settings
    specimen = draw_specimen(design, Scatter(alpha=0.01), 0)
    forecasts = forecast_words(specimen, settings)  # which both devices share
    monkeypatch.setattr(memory, 'choose_reader', lambda *_, **__: WaveformReader(forecasts))
    found = plan_pulses(specimen, chosen)
    assert found.complete
    assert [len(found.steps), len(found.kinks), len(found.corrections.kinks)] == [3, 2, 3]
    known = Element(specimen, np.zeros(design.N), plan=found.corrections)
    written = {}
    for kicks in (settings, known.apply_planned_kicks(settings)):
        device = MemoryElement(
            design, kicks, driver=Simulation.build_blank(specimen, settings.time)
        )
        outcomes = [device.perform(Write(word)) for word in range(device.reader.content_count)]
        written[kicks] = [outcome.success for outcome in outcomes].count(True)
    assert written[settings] <= 4
    assert written[known.apply_planned_kicks(settings)] == 8


@pytest.fixture
def longer_steps(monkeypatch):
    """Three times as long: a carrier is 0.1 rad off after 900 time units."""
    monkeypatch.setattr(validity, 'Rk4Element', partial(Rk4Element, step=0.2))


@pytest.mark.parametrize('way', ['relative damping', 'friction', 'end mass', 'softer'])
def test_next_to_nothing_passes_any_trial(way, longer_steps):
    """Damping of v - V is all or nothing, and slow writes do not feel it."""
    amount = 1.0 if way in ('relative damping', 'end mass') else 1e-9
    assert validity.try_amount('bits_1', way, amount).passed


def test_friction_above_the_limit_fails_its_trial(longer_steps):
    """The wall stops short, and no write is called a success that is none."""
    trial = validity.try_amount('bits_1', 'friction', 3e-5)
    assert not trial.passed
    assert trial.read <= trial.reached


ANSWERS = {(each.problem, each.quantity): each for each in read_answers(ANSWERS_FILE)}


@pytest.mark.parametrize('problem', ALL_PROBLEMS, ids=lambda each: each.name)
def test_committed_answers_are_those_of_longer_steps(problem):
    """Twice the step, whose error is below 0.1 %."""
    found = problem.solve(2.0 * problem.step)
    assert {name for kind, name in ANSWERS if kind == problem.name} == set(found)
    for name, value in found.items():
        ours = ANSWERS[problem.name, name]
        limit = max(1e-3 * abs(ours.value), 10.0 * ours.error)
        assert value == pytest.approx(ours.value, rel=0.0, abs=limit), name


calibrated = cache(watched.WatchedElement)


@pytest.fixture
def calibrated_once(monkeypatch):
    """An element is made, planned and calibrated once, and every test has a copy."""
    monkeypatch.setattr(watched, 'WatchedElement', lambda *which: deepcopy(calibrated(*which)))


def test_healthy_element_is_read_and_nothing_is_told(calibrated_once):
    found = watched.watch_healthy('bits_1', 0.01, 2, reads=5)
    assert found['reads'] == 4  # not that of the write, whose waves are still about
    assert found['alarms'] == 0


@pytest.mark.parametrize('change', ['a cell 8 % weaker', 'left gain - 5 %'])
def test_change_is_told_with_its_name_and_amount(change, calibrated_once):
    found = watched.watch_changed('bits_1', 0.01, 2, change)
    assert (found['alarm'], found['named']) == (False, True)
    assert found['reads'] == 2
    assert found['off'] < 0.2


def test_element_that_cannot_be_calibrated_is_not_watched(monkeypatch):
    failed = SimpleNamespace(success=False, error='no wall')
    monkeypatch.setattr(watched, 'load_forecast', lambda *_: None)
    monkeypatch.setattr(watched, 'perform_command', lambda *_: (failed, []))
    with pytest.raises(ProcedureFailed, match='seed 7: no wall'):
        watched.WatchedElement('bits_1', 0.01, 7)


def test_elements_that_fail_are_counted_beside_those_watched():
    def watch(seed):
        if seed == 2:
            raise ProcedureFailed('seed 2: no wall')
        return {'seed': seed}

    rows, failed = watch_elements(watch, range(1, 4))
    assert [row['seed'] for row in rows] == [1, 3]
    assert failed == ['seed 2: no wall']


def test_false_alarms_and_changes_not_told_are_counted():
    row = {'seed': 1, 'site': 4, 'wall': 9.0, 'text': '', 'named': False, 'reads': None}
    told = row | {'text': 'cell 4 ...', 'named': True, 'reads': 2, 'off': 0.1, 'alarm': True}
    found = watched.summarise_changed([row | {'off': None, 'alarm': False}, told])
    assert [found[name] for name in ('told', 'named', 'alarms', 'reads')] == [1, 1, 1, 2.0]
    assert found['off'] == pytest.approx(10.0)
    assert found['silent'] == [{'seed': 1, 'site': 4, 'wall': 9.0}]


def test_fit_that_lies_is_counted():
    """Whose error is beyond three times what it states; refusals are kept with their reason."""
    row = {
        'seed': 1, 'shots': 9, 'chi2': 1.0, 'in band': 1.1, 'added': [],
        'inside': 0.9, 'error': 1e-3, 'stated': 9e-4,
    }  # fmt: skip
    lying = row | {'error': 3e-3, 'added': ['latency', 'springs']}
    found = surveyed.summarise_fits([row, lying, {'seed': 3, 'refused': 'why'}])
    assert [found[name] for name in ('elements', 'fitted', 'lies')] == [3, 2, 1]
    assert found['added'] == {'nothing': 1, 'latency, springs': 1}
    assert found['refused'] == ['why']
