# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reads of shaken elements, counted."""

import itertools

import numpy as np
import pytest

from mlmem import Settings
from mlmem.physics import CASE_II
from mlmem.presets import load_preset
from mlmem_lab.shaken import STANDARD_GRAVITY, Counts, Shaking, count

TICK = 2e-3


def course(shaking, n, seed=1):
    return np.array(list(itertools.islice(shaking.course(seed, TICK), n)))


def test_an_imu_of_200_hz_sends_a_message_every_two_and_a_half_ticks():
    accelerations = course(Shaking('white', 1.0), 10_000)
    assert len(np.unique(accelerations)) == pytest.approx(4000, abs=1)
    assert np.abs(accelerations).max() == pytest.approx(STANDARD_GRAVITY, rel=1e-3)
    assert accelerations.std() == pytest.approx(STANDARD_GRAVITY / 3**0.5, rel=0.03)


def test_a_sine_has_its_frequency():
    accelerations = course(Shaking('sine', 2.0, 125.0), 1000)
    assert np.argmax(np.abs(np.fft.rfft(accelerations))) == 250  # of 2 s
    assert accelerations.std() == pytest.approx(2.0 * STANDARD_GRAVITY / 2**0.5, rel=0.01)


def test_a_walk_has_two_footfalls_per_second():
    power = np.abs(np.fft.rfft(course(Shaking('walk', 1.0), 10_000))) ** 2  # of 20 s
    assert np.argmax(power) == 40
    high = power[400:].sum() / power.sum()  # beyond 20 Hz
    assert 0.05 < high < 0.8


def test_slams_are_rare_and_loud():
    accelerations = np.abs(course(Shaking('slams', 5.0), 10_000)) / STANDARD_GRAVITY
    loud = accelerations > 1.0
    assert np.all(accelerations[loud] == 5.0)
    assert accelerations[~loud].max() < 5e-3
    assert 0.005 < loud.mean() < 0.05


def test_counts_add_up():
    counts = Counts(right=3, undecodable=1, blocks=1, ticks=10)
    other = Counts(right=1, wrong=1, blocks=1, wrong_blocks=1)
    counts.add(other)
    assert (counts.reads, counts.ticks) == (6, 10)
    assert counts.lies.value == pytest.approx(1 / 2)  # of blocks


def test_a_count_repeats_to_the_bit():
    shaking = Shaking('white', 1.5)
    first, again = (count(CASE_II, Settings(), shaking, 'left', 7, 2, seed=5) for _ in range(2))
    assert (first.right, first.wrong, first.undecodable) == (2, 0, 0)
    assert first.ticks == again.ticks


def test_a_short_element_is_waited_for_longer_than_its_echo_takes():
    """Its echoes of 250 time units travel to and fro, and could be mistaken for shaking."""
    design, settings = load_preset('bits_1')
    for level in range(2):
        counts = count(design, settings, Shaking('white', 2.0), 'right', level, 4, seed=level)
        assert counts.right == 4


def test_a_wall_that_was_shaken_off_is_not_counted():
    counts = count(CASE_II, Settings(), Shaking('sine', 400.0, 16.0), 'left', 3, 1, seed=1)
    assert (counts.reads, counts.moved) == (0, 1)
