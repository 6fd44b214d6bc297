# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whole runs, each determined by one number. `make seeded-runs` runs many more."""

import pytest
from sampled import sampled

from .script import make_script
from .world import SeededRun, describe_run, run_seed

SHORT_SEEDS = (77, 17, 30, 46, 73, 40, 20, 24, 32, 34, 44, 45, 52, 63, 64, 68, 75, 81, 84, 92)
"""Of the first hundred runs those that together reach the most code in a second, and first those
that find planted bugs.
"""


@pytest.mark.parametrize(
    'seeds', sampled([SHORT_SEEDS, range(1000)], lambda seeds: seeds is SHORT_SEEDS)
)
def test_nothing_is_wrong_in_a_life(seeds):
    for seed in seeds:
        if run_seed(seed):
            pytest.fail(describe_run(seed), pytrace=False)


def test_a_life_is_its_number():
    def history(seed):
        run = SeededRun(make_script(seed))
        run.run()
        return run.scheduler.handovers, list(map(str, run.scheduler.history))

    assert history(3) == history(3)
    assert history(3) != history(4)
