# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The shots of a survey come back from a session as they were taken, or are refused."""

import numpy as np
import pytest

from mlmem_ros.contract.values import SHOT_HEAD, numbers
from mlmem_ros.device.end import End, Shot
from mlmem_ros.session.data import _shot

SAMPLES = np.array([[1e-5, -2e-5, np.nan], [3e-7, 0.0, np.nan]])
"""With a sample that an interruption took."""

TAKEN = Shot(End.RIGHT, 0.7, 1e-3, 40.0, 62.0, -0.009, 0.5, np.array([0.1, -0.2]), SAMPLES)


def test_a_shot_comes_back_with_its_gaps():
    found = _shot(numbers(TAKEN), SHOT_HEAD)
    for name in ('end', 'omega_c', 'A', 'sigma', 'wall', 'strain', 'dt'):
        assert getattr(found, name) == getattr(TAKEN, name)
    assert np.array_equal(found.rest, TAKEN.rest)
    assert np.array_equal(found.samples, SAMPLES, equal_nan=True)


@pytest.mark.parametrize(
    ('place', 'value', 'named'),
    [
        (1, 0.0, 'carrier, sigma and interval above 0'),
        (3, -40.0, 'carrier, sigma and interval above 0'),
        (4, np.nan, 'must be finite'),
        (7, np.inf, 'must be finite'),
        (SHOT_HEAD, np.inf, 'must be finite'),
    ],
)
def test_an_impossible_shot_is_refused(place, value, named):
    data = numbers(TAKEN)
    data[place] = value
    with pytest.raises(ValueError, match=named):
        _shot(data, SHOT_HEAD)


@pytest.mark.parametrize(('kept', 'offset'), [(None, 0), (-1, SHOT_HEAD), (SHOT_HEAD, SHOT_HEAD)])
def test_a_shot_without_two_whole_rows_is_refused(kept, offset):
    with pytest.raises(ValueError, match='2 rows of samples'):
        _shot(numbers(TAKEN)[:kept], offset)
