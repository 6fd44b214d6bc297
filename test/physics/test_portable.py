# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The exponential, also where a decay underflows."""

import numpy as np

from mlmem_ros.physics.portable import exponential


def test_a_decay_ends_at_zero_however_far_out():
    with np.errstate(all='raise', under='ignore'):
        far = exponential(-np.array([746.0, 1e4, 1e19, 1e60, 1e300, np.inf]))
    assert (far == 0.0).all()


def test_within_the_range_of_numbers_it_is_the_exponential():
    x = np.linspace(-700.0, 700.0, 2001)
    np.testing.assert_allclose(exponential(x), np.exp(x), rtol=3e-13)
