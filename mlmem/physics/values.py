# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Arrays of numbers, and the errors of what is no design or no state."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..rejections import Rejected

Array = NDArray[np.float64]


Complex = NDArray[np.complex128]


class DesignError(Rejected, ValueError):
    """A design out of range or inconsistent: the message names symbol, value and bound."""


class StateError(Rejected, ValueError):
    """Arrays that are not a state of this chain: wrong shape, not finite, wrong kind."""


def require_finite(field: str, values: ArrayLike, shape: tuple[int, ...]) -> None:
    """Raise `StateError` unless these are finite numbers of a shape; () stands for one number."""
    if np.shape(values) != shape:
        raise StateError.out_of_range(field, np.shape(values), f'of shape {shape}')
    if not np.isfinite(values).all():
        raise StateError.out_of_range(field, 'NaN or infinity', 'finite')
