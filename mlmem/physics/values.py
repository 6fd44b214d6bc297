# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Arrays of numbers, and the errors of what is no design or no state."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..rejections import Rejected

Array = NDArray[np.float64]


class DesignError(Rejected, ValueError):
    """A design out of range or inconsistent: the message names symbol, value and bound."""


class StateError(Rejected, ValueError):
    """Arrays that are not a state of this chain: wrong shape, not finite, wrong kind."""
