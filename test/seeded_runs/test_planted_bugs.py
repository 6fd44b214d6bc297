# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Seeded runs find planted bugs: each that is put back is found soon."""

from itertools import count

import pytest

from .planted_bugs import PLANTED_BUGS, plant
from .world import run_seed

MAX_RUNS = 10_000
"""Runs within which a fault has to be found."""

FIRST_SEEDS = {
    'no_sync_before_the_rename': 6,
    'state_taken_within_a_tick': 3,
    'two_recordings_at_once': 6,
}
"""Faults that the first few runs find, and from which run on."""


def runs_until_found(name, most, first=0):
    """Return the runs until a fault is found; runs that fail without it do not count."""
    for seed in count(first):
        assert seed < most, f'{name} is not found within {most} runs'
        with plant(name):
            found = run_seed(seed)
        if found and not run_seed(seed):
            return seed + 1
    return None


def test_every_planted_bug_replaces_functions_that_exist():
    for name in PLANTED_BUGS:
        with plant(name):
            pass


@pytest.mark.parametrize('name', FIRST_SEEDS)
def test_coarse_planted_bug_is_found_at_once(name):
    runs_until_found(name, most=20, first=FIRST_SEEDS[name])


@pytest.mark.slow
@pytest.mark.parametrize('name', PLANTED_BUGS)
def test_planted_bug_is_found(name):
    print(f'{name}: {runs_until_found(name, MAX_RUNS)} runs')
