# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Values from the node's messages, live or from a bag: the inverse of `messages`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..clipped import clipped
from ..words import JOINT


def values(status: Any) -> dict[str, str]:
    """Return the keys and values of a DiagnosticStatus."""
    return {pair.key: pair.value for pair in status.values}


def echo(message: Any) -> NDArray[np.float64]:
    """Return the rows t, v_m and v_c of an echo, shape (3, n).

    Raises:
        ValueError: It is not three rows of two or more finite numbers, the times first.
    """
    data = np.asarray(message.data, dtype=np.float64)
    if len(data) < 6 or len(data) % 3 or not np.isfinite(data).all():
        raise ValueError(f'data must be 3 rows of 2 or more finite numbers; got {clipped(data)}')
    t = data[: len(data) // 3]
    if not 0.0 < t[0] < t[1] or not (np.diff(t) >= 0.0).all():
        raise ValueError(f'the times of the samples must increase from 0; got {clipped(t)}')
    return data.reshape(3, -1)


def displacement(message: Any) -> float:
    """Return the displacement of the substrate's end in m from a JointState.

    Raises:
        ValueError: It has none.
    """
    places = dict(zip(message.name, message.position, strict=False))
    if JOINT not in places:
        raise ValueError(f'position must include the {JOINT}; got {clipped(places)}')
    return float(places[JOINT])
