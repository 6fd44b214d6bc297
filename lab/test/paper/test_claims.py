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

import numpy as np
import pytest

from mlmem_lab.paper.figure import Judgement
from mlmem_lab.paper.gallery import list_claims
from mlmem_lab.results import RESULT_FOLDER, load_result

BY_KEY = {claim.key: claim for claim in list_claims()}


@pytest.fixture(scope='module')
def committed():
    claims = load_result(RESULT_FOLDER / 'paper.json')['claims']
    return {key: claim['verdict'] for key, claim in claims.items()}


@pytest.mark.parametrize('key', BY_KEY)
@pytest.mark.parametrize('size', ['small', pytest.param('full', marks=pytest.mark.slow)])
def test_simulation_gives_the_committed_verdict(key, size, request, committed):
    computed = request.getfixturevalue(size)
    needed = {name: computed[name] for name in BY_KEY[key].needs}
    found = BY_KEY[key].judge_data(needed)
    assert found.judgement.value == committed[key], found.numbers


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
    assert claim.judge_data(data).judgement is not Judgement.HOLDS
