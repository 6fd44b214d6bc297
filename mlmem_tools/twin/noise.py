# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The noise of a waveform, measured in the waveform itself, and the drift of its zero."""

from __future__ import annotations

import math

import numpy as np

from mlmem_ros.device.shot import Shot
from mlmem_ros.physics.potential import Array

from .tangent import Single

FLOOR = 1e-6
"""Least standard deviation of a sample in cells: the error of the forward model's step."""

ORDER = 12
"""Order of the difference of samples that measures noise."""


def noise(shot: Shot) -> Array:
    """Return the standard deviation of a sample of either end after the pulse, shape (2,)."""
    after = math.ceil(shot.pulse.duration / shot.dt)
    return np.array([noise_of(samples[after:]) for samples in shot.samples])


def noise_of(samples: Array) -> float:
    """Return the standard deviation of white noise on a band-limited signal, at least `FLOOR`.

    A difference of high order removes motion that is slow beside the samples. Its median size is
    that of noise alone, even if some samples are missing.

    Args:
        samples: Shape (n,), equally spaced, at most 0.5 time units apart; NaN where missing.
    """
    differences = np.abs(np.diff(samples, ORDER))
    gain = math.sqrt(math.comb(2 * ORDER, ORDER))
    middle = float(np.nanmedian(differences)) if np.isfinite(differences).any() else 0.0
    return max(FLOOR, middle / (0.674489750196 * gain))


def whitened(waveforms: Array | Single, weights: Array) -> Array:
    """Return weighted waveforms, (2, m, ...), less their mean, but for the rest before them.

    So a waveform does not tell where a drifting transducer has its zero; the rest alone does.
    """
    found = np.asarray(weights * waveforms)
    total = np.sum(weights[:, 1:], axis=1, keepdims=True)
    mean = np.sum(found[:, 1:], axis=1, keepdims=True)
    found[:, 1:] -= weights[:, 1:] * np.divide(
        mean, total, out=np.zeros_like(mean), where=total > 0.0
    )
    return found
