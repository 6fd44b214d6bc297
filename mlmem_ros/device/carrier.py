# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A filter for the carrier of a pulse, against the slower sway of a shaken element."""

from __future__ import annotations

import math

from ..physics.potential import Array
from .settings import ProbeSettings

WEIGHTS = (0.0625, -0.25, 0.375, -0.25, 0.0625)
"""Weights of samples half a carrier period apart. The response, sin^4(pi omega / 2 omega_c), is 1
at the carrier and 0.1 % for motion ten times slower. Echoes lose a few per cent in height."""


def half_period(probe: ProbeSettings, dt: float) -> int:
    """Return half a period of the carrier in samples."""
    return max(1, round(math.pi / (probe.omega_c * dt)))


def carried(v: Array, lag: int) -> Array:
    """Return displacements without all motion far slower than the carrier.

    Args:
        v: Displacements, shape (n,).
        lag: Half a period of the carrier in samples.

    Returns:
        The filtered samples from index 2 lag to n - 2 lag, shape (n - 4 lag,); in phase, because
        the weights are symmetric.
    """
    n = max(0, len(v) - 4 * lag)
    passed: Array = WEIGHTS[0] * v[:n]
    for shift, weight in enumerate(WEIGHTS[1:], 1):
        passed += weight * v[shift * lag : shift * lag + n]
    return passed
