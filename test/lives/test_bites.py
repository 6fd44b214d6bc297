# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Seeded runs find planted bugs: each that is put back is found soon."""

from itertools import count

import pytest

from .bites import BITES
from .campaign import live

MOST = 10_000
"""Lives within which a fault has to be found."""

AT_ONCE = {
    'no_sync_before_the_rename': 3,
    'state_taken_within_a_tick': 3,
    'two_recordings_at_once': 6,
}
"""Faults that the first few lives find, and from which life on."""


def lives_until_found(name, most, first=0):
    """Return the lives until a fault is found; lives that fail without it do not count."""
    for seed in count(first):
        assert seed < most, f'{name} is not found within {most} lives'
        with BITES[name]():
            found = live(seed)
        if found and not live(seed):
            return seed + 1
    return None


@pytest.mark.parametrize('name', BITES)
def test_planted_bug_replaces_a_function_that_exists(name):
    with BITES[name]():
        pass


@pytest.mark.parametrize('name', AT_ONCE)
def test_coarse_planted_bug_is_found_at_once(name):
    lives_until_found(name, most=20, first=AT_ONCE[name])


@pytest.mark.slow
@pytest.mark.parametrize('name', BITES)
def test_planted_bug_is_found(name):
    print(f'{name}: {lives_until_found(name, MOST)} lives')
