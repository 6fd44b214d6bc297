# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An echo as a page draws it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..contract import told

SAMPLES = 1200
"""Most samples of an echo in a picture; of several the largest is kept."""


def thinned(message: Any) -> NDArray[np.float32]:
    """Return times and v_c of an echo message, thinned out, of shape (2, n).

    Args:
        message: Of `~/echo`.

    Raises:
        ValueError: It is not an echo.
    """
    t, _, v_c = told.echo(message)
    group = math.ceil(len(t) / SAMPLES) or 1
    whole = len(t) // group * group
    t, v_c = t[:whole].reshape(-1, group)[:, -1], v_c[:whole].reshape(-1, group).max(axis=1)
    return np.stack((t, v_c)).astype(np.float32)
