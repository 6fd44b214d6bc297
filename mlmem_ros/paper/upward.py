# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Writes upward on the bare chain: from each level to each higher one, and maps of them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from ..analysis.steps_up import scaled, steps_up
from ..device.settings import WriteSettings
from ..physics import Design
from ..physics.potential import Array


def writes(
    design: Design, write: WriteSettings, starts: Iterable[int] | None = None
) -> Iterator[bool]:
    """Yield for every write upward whether it succeeds; see `steps_up`.

    Args:
        design: The element.
        write: Its cycles. The rate of an actuator does not limit them here.
        starts: The levels that are started from, a wall at rest at each; all by default.
    """
    last = design.levels - 1
    for start in range(last) if starts is None else starts:
        yield from steps_up(design, write, start, last)


def passes(
    design: Design, write: WriteSettings, factors: Array, starts: Iterable[int] | None = None
) -> Array:
    """Return where all writes upward succeed, over factors on both peaks.

    Args:
        design: The element.
        write: The operating point.
        factors: On either peak, shape (m,).
        starts: As for `writes`, which may be passed through more than once.

    Returns:
        By compression and tension, booleans of shape (m, m).
    """
    return np.array(
        [
            [all(writes(design, scaled(write, first, second), starts)) for second in factors]
            for first in factors
        ]
    )


def distance(factors: Array, passed: Array) -> float:
    """Return how far the operating point is from the nearest failure of a map.

    The measure is that of `mlmem margins`: the root of the sum of the squares of both relative
    changes; infinite where nothing fails.

    Args:
        factors: On either peak, shape (m,).
        passed: By compression and tension, shape (m, m).
    """
    far = np.hypot(factors[:, None] - 1.0, factors[None, :] - 1.0)
    return float(np.min(far[~passed], initial=np.inf))
