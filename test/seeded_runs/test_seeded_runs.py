# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whole runs, each determined by one number. `make seeded-runs` runs many more."""

import pytest
from suite import sampled

from seeded_runs.planted_bugs import PLANTED_BUGS, plant
from seeded_runs.world import SeededRun, describe_run

SHORT_SEEDS = (77, 17, 30, 46, 73, 40, 20, 24, 32, 34, 44, 45, 52, 63, 64, 68, 75, 81, 84, 92)
"""Of the first hundred runs those that together reach the most code in a second, and first those
that find planted bugs.
"""


@pytest.mark.parametrize(
    'seeds', sampled([SHORT_SEEDS, range(1000)], lambda seeds: seeds is SHORT_SEEDS)
)
def test_nothing_is_wrong_in_a_life(seeds):
    for seed in seeds:
        if SeededRun(seed).run():
            pytest.fail(describe_run(seed), pytrace=False)


def test_a_life_is_its_number():
    def history(seed):
        run = SeededRun(seed)
        run.run()
        return run.scheduler.handovers, list(map(str, run.scheduler.history))

    assert history(3) == history(3)
    assert history(3) != history(4)


# --- planted bugs --------------------------------------------------------------------------

MAX_RUNS = 10_000
"""Runs within which a fault has to be found."""

COARSE_BUGS = (
    'assertion_when_nothing_is_recorded',
    'no_sync_after_the_rename',
    'no_sync_before_the_rename',
    'session_begun_within_a_tick',
    'state_taken_within_a_tick',
    'strain_is_left_on_at_the_end',
    'two_recordings_at_once',
    'who_waits_at_the_end_is_forgotten',
)
"""Faults that four and more of the short seeds find: some do if threads run in another order."""


def test_every_planted_bug_replaces_functions_that_exist():
    for name in PLANTED_BUGS:
        with plant(name):
            pass


@pytest.mark.parametrize('name', COARSE_BUGS)
def test_coarse_planted_bug_is_found_by_short_seeds(name):
    with plant(name):
        assert any(SeededRun(seed).run() for seed in SHORT_SEEDS)


@pytest.mark.slow
@pytest.mark.parametrize('name', PLANTED_BUGS)
def test_planted_bug_is_found(name):
    """Runs that fail without it do not count."""
    for seed in range(MAX_RUNS):
        with plant(name):
            found = SeededRun(seed).run()
        if found and not SeededRun(seed).run():
            print(f'{name}: {seed + 1} runs')
            return
    pytest.fail(f'{name} is not found within {MAX_RUNS} runs')
