# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Seeded runs find planted bugs: each that is put back is found soon."""

import pytest

from .planted_bugs import PLANTED_BUGS, plant
from .test_seeded_runs import SHORT_SEEDS
from .world import run_seed

MAX_RUNS = 10_000
"""Runs within which a fault has to be found."""

COARSE_BUGS = set(PLANTED_BUGS) - {
    'lost_wake_up',
    'not_a_number_reaches_the_strain',
    'queue_cleared_between_look_and_pop',
    'recorder_joined_in_the_executor',
    'who_waits_for_a_hanging_disk_is_not_told',
}
"""Faults that the seeds of every run of the tests find."""


def test_every_planted_bug_replaces_functions_that_exist():
    for name in PLANTED_BUGS:
        with plant(name):
            pass


@pytest.mark.parametrize('name', sorted(COARSE_BUGS))
def test_coarse_planted_bug_is_found_by_short_seeds(name):
    with plant(name):
        assert any(map(run_seed, SHORT_SEEDS))


@pytest.mark.slow
@pytest.mark.parametrize('name', PLANTED_BUGS)
def test_planted_bug_is_found(name):
    """Runs that fail without it do not count."""
    for seed in range(MAX_RUNS):
        with plant(name):
            found = run_seed(seed)
        if found and not run_seed(seed):
            print(f'{name}: {seed + 1} runs')
            return
    pytest.fail(f'{name} is not found within {MAX_RUNS} runs')
