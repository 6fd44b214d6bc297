# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Running mean and deviation of the lateness of ticks."""

import numpy as np
import pytest

from mlmem_ros.device.timetable import LoopStatistics


def test_the_first_ticks_have_equal_weights():
    """Up to tick 500, the inverse of the later weight of the newest tick."""
    lateness = np.random.default_rng(1).exponential(1e-4, 400)
    statistics = LoopStatistics()
    for value in lateness:
        statistics.count(value, 2.0 * value)
    assert statistics.ticks == 400
    assert statistics.lateness_mean == pytest.approx(lateness.mean())
    assert statistics.lateness_deviation == pytest.approx(lateness.std())
    assert statistics.busy == pytest.approx(2.0 * lateness.mean())


def test_old_ticks_lose_their_weight():
    statistics = LoopStatistics()
    for value in [1.0] * 1000 + [0.0] * 5000:
        statistics.count(value, value)
    # 5000 ticks of weight 1 / 500: exp(-10) is left
    assert statistics.lateness_mean < 1e-4
    assert statistics.lateness_deviation < 1e-2
    assert statistics.busy < 1e-4


def test_a_loop_that_never_ran_has_no_lateness():
    assert LoopStatistics().lateness_deviation == 0.0


def test_a_clock_that_jumps_back_within_a_tick_counts_as_no_time():
    statistics = LoopStatistics()
    statistics.count(0.0, -4.5)
    assert statistics.busy == 0.0
