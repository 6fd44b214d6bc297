# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The carrier filter: it passes the pulse of one end, and nothing slower or of the other end.

Both ends listen at the same time. A wall reflects nearly all of either pulse, but the left end's
threshold is so low that it would hear what passes of the right end's. The carriers differ by a
factor of three, so a cosine under a Gaussian separates them. It also removes sensor noise, a
shaken base, and the swinging of all cells in phase that a strain leaves behind.
"""

from __future__ import annotations

import math

import numpy as np

from ..physics.jit import kernel
from ..physics.portable import cosine, exponential
from ..physics.potential import Array
from .settings import ProbeSettings

PERIODS = 1.0
"""Standard deviation of the Gaussian in carrier periods: of 0.43 of the carrier 0.2 % pass."""

REACH = 4.0
"""Standard deviations at which it is cut off, where it has fallen to 0.03 %."""


def weights(probe: ProbeSettings, dt: float) -> Array:
    """Return the weights of the filter for samples dt apart, shape (2n + 1,), symmetric.

    They pass the carrier unchanged and remove a constant.
    """
    sigma = PERIODS * 2.0 * math.pi / probe.omega_c
    n = math.ceil(REACH * sigma / dt)
    t: Array = dt * np.arange(-n, n + 1, dtype=np.float64)
    envelope = exponential(-0.5 * (t / sigma) ** 2)
    wave = cosine(probe.omega_c * t)
    wave = envelope * (wave - (envelope * wave).sum() / envelope.sum())
    return np.asarray(wave / (wave * cosine(probe.omega_c * t)).sum())


def carried(v: Array, weights: Array) -> Array:
    """Return the carrier's part of displacements, shape (m,), for v of shape (m + 2n,).

    It is in phase with v[n:-n].
    """
    passed = np.zeros(max(0, len(v) - len(weights) + 1))
    _filter(v, weights, passed)
    return passed


def loudness(v: Array, weights: Array, ticks: int) -> list[float]:
    """Return the mean magnitude of the carrier's part in each of some ticks.

    `v` has shape (m ticks + 2n,), with m samples in a tick.
    """
    magnitudes = np.abs(carried(v, weights)).reshape(ticks, -1)
    means: list[float] = (np.add.reduce(magnitudes, axis=1) / magnitudes.shape[1]).tolist()
    return means


@kernel
def _filter(v: Array, weights: Array, passed: Array) -> None:
    """Add weight by weight, so that the bits do not depend on how many samples come at once."""
    for k in range(len(weights)):
        weight = weights[k]
        for i in range(len(passed)):
            passed[i] += weight * v[i + k]
