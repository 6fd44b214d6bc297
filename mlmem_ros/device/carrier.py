# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Separating a pulse's carrier from slower motion: the sway of a shaken element."""

from __future__ import annotations

import math

from ..physics.potential import Array
from .settings import ProbeSettings

WEIGHTS = (0.0625, -0.25, 0.375, -0.25, 0.0625)
"""Of samples half a carrier period apart: together sin^4(pi omega / 2 omega_c), which is 1 at the
carrier. Motion ten times slower loses 99.9 %, an echo a few per cent of its height."""


def half_period(probe: ProbeSettings, dt: float) -> int:
    """Return half a period of the carrier in samples."""
    return max(1, round(math.pi / (probe.omega_c * dt)))


def carried(v: Array, lag: int) -> Array:
    """Return displacements with all motion far slower than the carrier removed.

    Args:
        v: Displacements, shape (n,).
        lag: Half a period of the carrier in samples.

    Returns:
        Those of the samples from the one at 2 lag to the one at n - 2 lag, shape (n - 4 lag,);
        in phase, for the weights are even.
    """
    n = max(0, len(v) - 4 * lag)
    passed: Array = WEIGHTS[0] * v[:n]
    for shift, weight in enumerate(WEIGHTS[1:], 1):
        passed += weight * v[shift * lag : shift * lag + n]
    return passed
