# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The margins of the faster schedules: the numbers of docs/fast_write.md, at their corners."""

import dataclasses

import pytest

from mlmem_ros.device import Settings
from mlmem_ros.device.fast import FAST
from mlmem_ros.physics import CASE_II
from mlmem_ros.studies.figures.fast_write import (
    DENSE,
    DENSE_WRITE,
    HASTY_WRITE,
    duration,
    failures,
)


def test_the_units_per_level():
    times = [duration(write) for write in (Settings().write, FAST.write, DENSE_WRITE, HASTY_WRITE)]
    assert times == [4500.0, 2200.0, 600.0, 450.0]


def moved(write, compression, tension):
    return dataclasses.replace(
        write, compression=compression * write.compression, tension=tension * write.tension
    )


@pytest.mark.parametrize('gains', [(0.7, 0.8), (0.7, 1.2), (1.5, 0.8), (1.5, 1.2)])
def test_the_peaks_may_be_off(gains):
    """The corners of the box that docs/fast_write.md states; all 28 writes upward."""
    assert failures(CASE_II, moved(FAST.write, *gains)) == 0


@pytest.mark.parametrize('gains', [(0.6, 0.9), (0.6, 1.1), (1.5, 0.9), (1.5, 1.1)])
def test_the_peaks_of_the_dense_element_may_be_off(gains):
    assert failures(DENSE, moved(DENSE_WRITE, *gains)) == 0


@pytest.mark.parametrize('gains', [(0.4, 1.0), (1.0, 0.5)])
def test_a_peak_that_is_far_too_weak_frees_no_wall(gains):
    assert failures(CASE_II, moved(FAST.write, *gains), starts=[0, 1]) > 6


def test_in_450_a_row_of_steps_is_not_safe():
    assert 0 < failures(DENSE, HASTY_WRITE) < 14


def test_the_tension_works_by_its_haste():
    """Slowly raised it frees no wall: of the writes from level 1 none comes out right."""
    slow = dataclasses.replace(FAST.write, ramp=1200.0)
    assert failures(CASE_II, slow, starts=[1]) == 6
