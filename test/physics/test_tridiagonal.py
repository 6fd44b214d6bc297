# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The chain's linear systems against numpy's dense solver and its eigenvalues."""

import numpy as np
import pytest

from mlmem_ros.physics.equilibrium import solve


@pytest.mark.parametrize('n', [1, 2, 3, 50])
def test_it_solves_what_numpy_solves(n):
    random = np.random.default_rng(n)
    diagonal, beside = 2.0 + random.random(n), -random.random(n - 1)
    right = random.standard_normal((3, n))
    matrix = np.diag(diagonal) + np.diag(beside, 1) + np.diag(beside, -1)
    solution = right.copy()
    assert solve(diagonal.copy(), beside, solution)
    # the condition number is below 5 / min(random), a few hundred
    exact = np.linalg.solve(matrix, right.T).T
    np.testing.assert_allclose(solution, exact, rtol=1e-10, atol=1e-12)


def test_it_detects_a_matrix_that_is_not_positive_definite():
    """The least eigenvalue of n springs is 2 - 2 cos(pi / (n + 1)); a shift passes it."""
    n = 10
    least = 2.0 - 2.0 * np.cos(np.pi / (n + 1))
    for shift, definite in ((0.99 * least, True), (1.01 * least, False)):
        assert solve(np.full(n, 2.0 - shift), -np.ones(n - 1), np.ones((1, n))) is definite
