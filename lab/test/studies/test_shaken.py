# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reads of shaken elements, counted."""

import itertools

import numpy as np
import pytest

from mlmem import Settings
from mlmem.physics import CASE_II
from mlmem_lab.shaken import Shaking, count_block

TICK = 2e-3


def course(shaking, n, seed=1):
    return np.array(list(itertools.islice(shaking.generate_course(seed, TICK), n)))


def test_imu_of_200_hz_sends_every_two_and_a_half_ticks():
    accelerations = course(Shaking('white', 1.0), 10_000)
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
