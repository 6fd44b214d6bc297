# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The speeds that a calibration tries until a kick takes the wall to its level."""

import numpy as np
import pytest

from mlmem.readers.delay_calibration import KickSearch

SCRIPTS = {
    'faster': ((1.30, 1.35), lambda speed: -1, [0, 1, 2, 3]),
    'between': ((0.70, 0.74), lambda speed: 1 if speed > 0.72 else -1, [0, -1, -2, -3, -4, -3.5]),
    'not heard': ((0.80, 0.84), lambda speed: 0, [0, -1, -2]),
    'slower than all that fall short': (
        (0.80, 0.84), lambda speed: -1, [*range(7), -1, -2]
    ),
    'faster than all that go too far': (
        (1.30, 1.35), lambda speed: 1, [*range(0, -7, -1), 1, 2, 3]
    ),
}  # fmt: skip
"""Range of the speeds that take a wall to its level; to which side others take it; and the speeds
to be tried, as powers of 1.1.
"""


@pytest.mark.parametrize('script', SCRIPTS)
def test_kick_search_brackets_the_speed_on_either_side(script):
    """It steps by a tenth up to a factor of 1.8, then on the other side, and halves a bracket."""
    (low, high), find_side, powers = SCRIPTS[script]
    search, tried = KickSearch(1.0, tries=20), [1.0]
    while not search.has_arrived(float(low < search.speed < high)):
        assert search.change_speed(0.0, find_side(search.speed))
        tried.append(search.speed)
    assert tried == pytest.approx(np.power(1.1, powers))


@pytest.mark.parametrize(('side', 'power'), [(-1, 0), (1, -2)])
def test_kick_that_was_not_heard_bounds_no_speed(side, power):
    """Its speed may have been the right one: only the next kick tells where a wall goes."""
    search = KickSearch(1.0, tries=20)
    for given, expected in ((0, -1), (side, power)):
        assert search.change_speed(0.0, given)
        assert search.speed == pytest.approx(1.1**expected)


def test_kick_search_on_the_other_side_forgets_its_bounds():
    """Where all faster kicks have fallen short, a slower one may go too far."""
    search = KickSearch(1.0, tries=20)
    for kick in range(7):
        assert search.change_speed(0.01 * kick, -1)
    assert search.speed == pytest.approx(1.0 / 1.1)
    assert search.change_speed(0.0, 1)
    assert search.speed == pytest.approx(1.0)
