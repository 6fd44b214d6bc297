# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a message's field cannot hold is refused, however the process was started."""

import numpy as np
import pytest

from mlmem_ros.contract.calls import fitted


@pytest.mark.parametrize(
    ('kind', 'low', 'high'),
    [('uint8', 0, 255), ('uint16', 0, 65535), ('int8', -128, 127), ('int64', -(2**63), 2**63 - 1)],
)
def test_whole_numbers_stay_in_their_range(kind, low, high):
    assert fitted('level', kind, low) == low
    assert fitted('level', kind, high) == high
    for value in (low - 1, high + 1, 2**70):
        with pytest.raises(ValueError, match=f'level must be a whole number from {low} to {high}'):
            fitted('level', kind, value)


@pytest.mark.parametrize(
    ('kind', 'values'),
    [
        ('uint16', (True, 2.5, '3', None, [3])),
        ('double', (True, '3', None, 10**400)),
        ('boolean', (0, 1, 'true', None)),
        ('string', (3, b'left', None, 'a\0b')),
        ('sequence<double>', (3.0, 'abc', None, [0.0, 'x'])),
    ],
)
def test_values_of_another_type_are_refused(kind, values):
    for value in values:
        with pytest.raises(ValueError, match=r'^it must be .*; got '):
            fitted('it', kind, value)


def test_numbers_of_numpy_are_taken():
    assert type(fitted('it', 'uint16', np.int64(5))) is int
    assert fitted('it', 'sequence<double>', [np.float32(0.5), 1]) == [0.5, 1.0]
