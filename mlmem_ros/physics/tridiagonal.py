# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Thomas's algorithm for the stiffness matrix of a chain: off-diagonal -1."""

from __future__ import annotations

import numpy as np

from .jit import kernel
from .potential import Array


@kernel
def solve(diagonal: Array, right: Array, solution: Array) -> bool:
    """Solve the system if its matrix is positive definite; the pivots show it.

    Args:
        diagonal: Diagonal of the matrix, shape (n,).
        right: Right side, shape (n,).
        solution: Out, shape (n,).

    Returns:
        Whether the matrix is positive definite; if not, the solution is not one.
    """
    n = len(diagonal)
    pivots = np.empty(n)
    pivots[0], solution[0] = diagonal[0], right[0]
    for j in range(1, n):
        if pivots[j - 1] <= 0.0:
            return False
        factor = 1.0 / pivots[j - 1]
        pivots[j] = diagonal[j] - factor
        solution[j] = right[j] + factor * solution[j - 1]
    if pivots[n - 1] <= 0.0:
        return False
    solution[n - 1] /= pivots[n - 1]
    for j in range(n - 2, -1, -1):
        solution[j] = (solution[j] + solution[j + 1]) / pivots[j]
    return True
