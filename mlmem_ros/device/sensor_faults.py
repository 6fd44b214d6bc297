# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Faulty transducers: noise and drop-out."""

from __future__ import annotations

import numpy as np

from ..chance import Stream, happens, normal
from ..physics.potential import Array
from .faults import Faults


def sensed(ends: Array, last: Array, faults: Faults, tick: int) -> Array:
    """Return the samples of both ends in a tick as faulty transducers measure them.

    Args:
        ends: The true displacements after every step, shape (2, steps).
        last: The last samples before, shape (2,).
        faults: Noise and drop-out.
        tick: The tick.
    """
    if happens(faults.sensor_dropout, faults.seed, tick, Stream.DROPOUT):
        return np.repeat(last[:, None], ends.shape[1], axis=1)
    if faults.sensor_noise:
        noise = normal(ends.shape, faults.seed, tick, Stream.NOISE)
        return np.asarray(ends + faults.sensor_noise * noise)
    return ends
