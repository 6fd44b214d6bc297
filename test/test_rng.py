# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Streams of random numbers: all differ, and a seed gives the same numbers as ever."""

import itertools

import numpy as np

from mlmem.rng import RandomStream, draw_normal, make_generator

SPAWNED = [
    RandomStream[name] for name in ('ALPHA', 'S', 'MASS', 'OFFSET', 'SCREEN', 'LEVELS', 'GAIN')
]


def test_streams_are_spawned_from_the_seed_in_order():
    children = np.random.SeedSequence(7).spawn(len(SPAWNED))
    for stream, child in zip(SPAWNED, children, strict=True):
        expected = np.random.Generator(np.random.PCG64(child)).random(5)
        assert make_generator(7, stream).random(5).tolist() == expected.tolist()


def test_no_two_streams_are_alike():
    ticks = [draw_normal((50,), 1, 2, stream) for stream in RandomStream if stream not in SPAWNED]
    made = [make_generator(1, stream).standard_normal(50) for stream in SPAWNED]
    for one, other in itertools.combinations([*ticks, *made], 2):
        assert not set(one) & set(other)
        assert abs(np.corrcoef(one, other)[0, 1]) < 0.5
