# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Randomness: every stream of random numbers has a name here, so that no two coincide.

The numbers of a tick depend on a seed and the tick alone. Philox is a counter-based generator: it
needs no state, so a device restored in mid-fault continues with the same numbers. Its raw numbers
are fixed by its paper (Salmon et al. 2011). We process them with integer arithmetic and single
roundings only, so every version of numpy gives the same result.
"""

from __future__ import annotations

from enum import IntEnum, unique

import numpy as np
from numpy.typing import NDArray


@unique
class RandomStream(IntEnum):
    """The uses of randomness; each has its own numbers.

    The first group belongs to a tick, the second to an element that is made and tried.
    """

    NOISE = 0
    DROPOUT = 1
    SLIP = 2

    ALPHA = 16
    S = 17
    MASS = 18
    OFFSET = 19
    SCREEN = 20
    LEVELS = 21
    GAIN = 22
    K_R = 23
    DEPTH = 24


def make_generator(seed: int, stream: RandomStream) -> np.random.Generator:
    """Return the random numbers of an element's stream."""
    # the streams of an element are spawned from its seed in order, from this one on
    key = np.random.SeedSequence(seed, spawn_key=(stream - RandomStream.ALPHA,))
    return np.random.Generator(np.random.PCG64(key))


def _draw_raw(seed: int, tick: int, stream: RandomStream, count: int) -> NDArray[np.uint64]:
    counter = np.array([0, tick, stream, 0], dtype=np.uint64)
    return np.asarray(np.random.Philox(key=seed, counter=counter).random_raw(count))


def draw_event(probability: float, seed: int, tick: int, stream: RandomStream) -> bool:
    """Return whether an event of a given probability happens at a tick."""
    if probability == 0.0:
        return False
    return bool((int(_draw_raw(seed, tick, stream, 1)[0]) >> 11) < probability * 2.0**53)


def draw_normal(
    shape: tuple[int, ...], seed: int, tick: int, stream: RandomStream
) -> NDArray[np.float64]:
    """Return numbers of mean 0 and standard deviation 1 for a tick.

    Each is a sum of sixteen uniform numbers: its kurtosis is 0.075 below the normal one, and its
    size at most 6.93.
    """
    count, uniforms = int(np.prod(shape)), 16
    words = _draw_raw(seed, tick, stream, count * uniforms // 4).astype('<u8')
    total = words.view('<u2').reshape(count, uniforms).sum(axis=1, dtype=np.int64)
    centred = (2 * total - uniforms * 0xFFFF).astype(np.float64)
    deviation = np.sqrt(uniforms * (2.0**32 - 1.0) / 3.0)  # of the doubled sum
    return np.asarray((centred / deviation).reshape(shape))
