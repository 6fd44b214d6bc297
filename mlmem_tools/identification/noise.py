# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The noise of a waveform, measured in the waveform itself, and the drift of its zero."""

from __future__ import annotations

import math

import numpy as np

from mlmem.instrument.end import Shot
from mlmem.physics.values import Array

from .tangent import Single


def estimate_noise(shot: Shot) -> Array:
    """Return the standard deviation of white noise on the samples of either end after the pulse,
    at least 1e-6 cells, shape (2,).

    A difference of high order removes motion that is slow beside the samples, which are at most
    0.5 time units apart. Its median size is that of noise alone, even if some samples are missing.
    """
    difference_order = 12  # order of the difference of samples that measures noise
    after = shot.samples[:, math.ceil(shot.pulse.duration / shot.dt) :]
    differences = np.abs(np.diff(after, difference_order))
    gain = math.sqrt(math.comb(2 * difference_order, difference_order))
    middle = [np.nanmedian(each) if np.isfinite(each).any() else 0.0 for each in differences]
    min_noise = 1e-6  # cells; the error of the forward model's step
    return np.maximum(min_noise, np.array(middle) / (0.674489750196 * gain))


def whiten_waveforms(waveforms: Array | Single, weights: Array, held: int = 0) -> Array:
    """Return weighted waveforms, (2, m), or (2, m, n), without slow changes of a transducer.

    It may have its zero anywhere, and a gain that drifts moves what is read of an end that rests:
    a straight line is taken out of the samples while an end is held, which reads what it is set
    to, and one out of those that follow. The rest before, the first sample, tells the zero alone.

    Args:
        waveforms: At rest, then sample by sample.
        weights: Shape (2, m).
        held: Samples while an end is held.
    """
    columns = waveforms.reshape(*waveforms.shape[:2], -1)
    found = np.asarray(weights[..., None] * columns)
    return remove_lines(found, weights, held).reshape(waveforms.shape)


def remove_lines(found: Array, weights: Array, held: int) -> Array:
    """Return weighted waveforms, (2, m, n), without these lines, which are taken out in place."""
    for part in (slice(1, 1 + held), slice(1 + held, None)):
        of_ends = found[:, part]
        times = np.linspace(-1.0, 1.0, of_ends.shape[1])
        level = np.stack((np.ones_like(times), times), axis=1)
        line = np.linalg.qr(weights[:, part, None] * level)[0]
        of_ends -= line @ (line.swapaxes(1, 2) @ of_ends)
    return found
