# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whole lives, each determined by one number. `make lives` runs many more."""

import pytest
from sampled import sampled

from .campaign import live, story
from .script import script
from .world import Life

AT_ONCE = 10


SHORT = 10, 30
"""Tens of lives that are short: number 8 alone takes as long as these twenty."""


@pytest.mark.parametrize('first', sampled(range(0, 1000, AT_ONCE), lambda first: first in SHORT))
def test_nothing_is_wrong_in_a_life(first):
    for seed in range(first, first + AT_ONCE):
        if live(seed):
            pytest.fail(story(seed), pytrace=False)


def test_a_life_is_its_number():
    def history(seed):
        life = Life(script(seed))
        life.live()
        return life.scheduler.handovers, list(map(str, life.scheduler.history))

    assert history(3) == history(3)
    assert history(3) != history(4)
