# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Thomas's algorithm for symmetric tridiagonal systems."""

from __future__ import annotations

from .jit import kernel
from .potential import Array


@kernel
def solve(diagonal: Array, beside: Array, right: Array) -> bool:
    """Solve a system for several right sides if its matrix is positive definite.

    Args:
        diagonal: Diagonal of the matrix, shape (n,); the pivots of the elimination afterwards.
        beside: The off-diagonal, shape (n - 1,).
        right: Right sides, shape (k, n); the solutions afterwards.

    Returns:
        Whether the matrix is positive definite; if not, there are no solutions.
    """
    n = len(diagonal)
    for j in range(n):
        if j > 0:
            factor = beside[j - 1] / diagonal[j - 1]
            diagonal[j] -= factor * beside[j - 1]
            for i in range(len(right)):
                right[i, j] -= factor * right[i, j - 1]
        if diagonal[j] <= 0.0:  # NaN passes through, for the caller to see
            return False
    for i in range(len(right)):
        right[i, n - 1] /= diagonal[n - 1]
        for j in range(n - 2, -1, -1):
            right[i, j] = (right[i, j] - beside[j] * right[i, j + 1]) / diagonal[j]
    return True
