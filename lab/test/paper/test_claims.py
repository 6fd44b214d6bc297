# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every verdict of the committed result, from a small simulation now, and at full size if slow.

=======================  =============================================================
the result says          must agree with
=======================  =============================================================
verdict of every claim   the judge's, on small data computed here
                         the judge's, on full data (slow)
a judge that approves    the same judge on doctored data: it must not approve
=======================  =============================================================
"""

import json

import numpy as np
import pytest

from mlmem_lab.paper.command import judge_claims
from mlmem_lab.paper.figure import Judgement, judge_numbers
from mlmem_lab.paper.gallery import ALL_CLAIMS, ALL_FIGURES
from mlmem_lab.results import RESULT_FOLDER, load_result
from mlmem_tools.cli.output import to_json_value

BY_KEY = {claim.key: claim for claim in ALL_CLAIMS}


@pytest.fixture(scope='module')
def committed():
    claims = load_result(RESULT_FOLDER / 'paper.json')['claims']
    return {key: claim['verdict'] for key, claim in claims.items()}


def test_the_result_holds_every_claim(committed):
    assert list(committed) == [claim.key for claim in ALL_CLAIMS]


@pytest.mark.parametrize('key', BY_KEY)
def test_a_small_simulation_gives_the_committed_verdict(key, small, committed):
    found = BY_KEY[key].judged(Needed(small, BY_KEY[key]))
    assert found.judgement.value == committed[key], found.numbers


@pytest.mark.slow
@pytest.mark.parametrize('key', BY_KEY)
def test_the_full_simulation_gives_the_committed_verdict(key, full, committed):
    found = BY_KEY[key].judged(Needed(full, BY_KEY[key]))
    assert found.judgement.value == committed[key], found.numbers


class Needed(dict):
    """The data that a claim needs, and no other."""

    def __init__(self, computed, claim):
        super().__init__({name: computed[name] for name in claim.needs})


# --- judges that can say no -------------------------------------------------------------------

WRONG = {
    'ground_states': {'ground_energies': lambda x: x + np.array([0.0, 1e-3])},
    'stiffnesses': {'stiffnesses_per_d': lambda x: [x[0], x[0]]},
    'permanent_profile': {'profile_kink': lambda x: x + 0.1},
    'constant_speed': {'speed_anti_kink': lambda x: x * np.linspace(0.5, 1.5, len(x))},
    'both_kinds': {'path_kink': lambda x: x[::-1]},
    'pinned_by_the_defect': {'path_defect': lambda x: x + 5.0},
    'displacement_fits': {'fits': lambda x: np.asarray(x) * 10.0},
    'strain_reproduced': {'v_0': lambda x: 0.8 * x},
    'ansatz_against_held': {'ansatz': lambda x: x + 0.01 * np.sin(np.arange(x.shape[1]))},
    'dip': {'held': lambda x: np.zeros_like(x)},
    'shallowing': {'held': lambda x: x[[5, 4, 3, 2, 1, 0, 10, 9, 8, 7, 6]]},
    'extrema_at_s_min': {'held': lambda x: -x},
    'extrema_at_s_max': {'wall': lambda x: x + 10.0},
    'row_i': {'path_compression_0': lambda x: -x},
    'row_ii': {'static_compression_1': lambda x: 0.5 * x},
    'row_iii': {'path_tension_2': lambda x: x - 19.0},
    'one_threshold': {'plain_left': lambda x: np.full_like(x, np.nan)},
    'echo_from_wall': {'delay_without_wall': lambda x: np.array(100.0)},
    'delay_grows': {'delay_ours_1': lambda x: np.array(0.0)},
    'delays_by_level': {'delay_paper': lambda x: np.full_like(x, x[0])},
    'either_boundary': {'delay_right': lambda x: x[::-1]},
    'eight_levels': {'moved': lambda x: np.ones_like(x)},
    'level_by_level': {'read': lambda x: x - 1},
    'one_step_per_cycle': {'moved': lambda x: 2 * x},
    'unidirectional': {'shift': lambda x: -x},
    'four_events': {'wall': lambda x: x + 1.0},
    'erase': {'left': lambda x: x + 1},
    'moved_launch': {'level': lambda x: np.ones_like(x)},
    'rigid_suffices': {'difference': lambda x: x + 1.0},
    'how_rigid': {'moved': lambda x: np.ones_like(x)},
    'low_frequency': {'echo': lambda x: x + 0.1},
}
"""For every claim that holds, a way to doctor its data that must be noticed."""


def test_every_claim_that_holds_is_tried_with_doctored_data(committed):
    assert set(WRONG) == {
        key for key, value in committed.items() if value in ('holds', 'with other numbers')
    }


@pytest.mark.parametrize('key', WRONG)
def test_doctored_data_do_not_pass(key, small):
    claim, changes = BY_KEY[key], WRONG[key]
    data = {name: dict(small[name]) for name in claim.needs}
    for name, change in changes.items():
        data[claim.needs[0]][name] = change(np.asarray(data[claim.needs[0]][name]))
    assert claim.judged(data).judgement is not Judgement.HOLDS


RIGHT = {
    'kink_fit': {'kink_e_rms': lambda x: x / 10.0},
    'bands': {'bands': lambda x: np.array([[0.4, 0.7], [0.8, 2.1]])},
    'printed_carrier': {'bands': lambda x: x + 0.5},
    'printed_threshold': {
        'pulse_v_c_printed_1': lambda x: 2.0 * x,
        'delay_printed_1': lambda x: np.array(400.0),
    },
    'printed_launch': {'kink': lambda x: np.full_like(x, 25.0)},
    'time_of_flight': {'delay_paper': lambda x: 141.3 * np.arange(len(x))},
}
"""For every claim that fails, the data with which it would not have failed."""


@pytest.mark.parametrize('key', RIGHT)
def test_a_claim_that_fails_could_have_held(key, small, committed):
    assert committed[key] != 'holds'
    claim = BY_KEY[key]
    data = {name: dict(small[name]) for name in claim.needs}
    if key == 'time_of_flight':  # exactly what Eq. (4) says
        flight = data['4b']['time_of_flight_paper']
        RIGHT[key]['delay_paper'] = lambda _: 50.0 + flight
    for name, change in RIGHT[key].items():
        data[claim.needs[0]][name] = change(np.asarray(data[claim.needs[0]][name]))
    assert claim.judged(data).judgement is Judgement.HOLDS


def test_judgements_are_made_from_conditions():
    assert judge_numbers(True, 'x') == (Judgement.HOLDS, 'x')
    assert judge_numbers(False, 'x', in_part=True) == (Judgement.IN_PART, 'x')
    assert judge_numbers(np.bool_(False), 'x') == (Judgement.FAILS, 'x')


# --- the result file: made of the data, whole ------------------------------------------------


def complete(computed):
    """What claims and the result file take."""
    kept = {figure.name for figure in ALL_FIGURES if figure.summary}
    return {name: computed[name] for name in kept.union(*(claim.needs for claim in ALL_CLAIMS))}


@pytest.fixture(scope='module')
def result(small):
    return json.loads(json.dumps(to_json_value(judge_claims(complete(small)))))


def test_a_verdict_changes_with_the_data(small, result):
    data, before = complete(small), result['claims']['delays_by_level']
    changed = data['4b'] | {'delay_paper': np.full_like(data['4b']['delay_paper'], 77.7)}
    after = judge_claims(data | {'4b': changed})['claims']['delays_by_level']
    assert (before['verdict'], after['verdict']) == ('with other numbers', 'fails')
    assert '77.7, 77.7' in after['finding']
    assert '77.7' not in before['finding']


def test_every_claim_is_in_the_result(result):
    assert list(result['claims']) == [claim.key for claim in ALL_CLAIMS]
    counts = dict(result['counts'])
    assert counts.pop('claims') == sum(counts.values()) == len(ALL_CLAIMS)
