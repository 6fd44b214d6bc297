# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Sine, cosine and exponential that give the same bits on every host.

numpy's own choose between instruction sets at run time, whose results differ in the last bit.
These are made of additions, multiplications and roundings only, each of which IEEE 754 fixes.
Everything that enters the material's state is computed with them, so that a session replays
exactly.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from .jit import kernel
from .potential import Array

# sin(r) / r as a polynomial in r^2 on [-pi/2, pi/2] (Chebyshev fit in 40 digits): error 1.2e-16;
# highest power first.
_SINE = (
    -7.374387503862757e-13,
    1.6048168318165643e-10,
    -2.505188194671259e-08,
    2.7557316609073673e-06,
    -1.9841269824861897e-04,
    8.333333333282756e-03,
    -0.16666666666666072,
    0.9999999999999999,
)
_EXPONENTIAL = tuple(1.0 / math.factorial(n) for n in range(13, -1, -1))
_LN2 = math.log(2.0)


def sine(x: Array) -> Array:
    """Return sin(x) within 1e-15 plus 2e-16 |x|, any shape."""
    return _of_each(_sine, x)


def cosine(x: Array) -> Array:
    """Return cos(x) within 1e-15 plus 2e-16 |x|, any shape."""
    return sine(x + 0.5 * math.pi)


def exponential(x: Array) -> Array:
    """Return exp(x) for x up to 700, within 3e-16 (1 + |x|) relative, any shape.

    Results below the least number are 0, down to exp(-inf).
    """
    return _of_each(_exponential, x)


def _of_each(function: Callable[[Array], None], x: Array) -> Array:
    values = np.array(x, dtype=np.float64, order='C')
    function(values.reshape(-1))
    return values


@kernel
def _sine(x: Array) -> None:
    """Replace numbers by their sines."""
    for i in range(len(x)):
        n = np.rint(x[i] * (1.0 / math.pi))
        r = x[i] - n * math.pi
        z, value = r * r, 0.0
        for coefficient in _SINE:
            value = value * z + coefficient
        half = 0.5 * n
        x[i] = r * value * (1.0 - 4.0 * (half - np.floor(half)))


@kernel
def _exponential(x: Array) -> None:
    """Replace numbers by their exponentials."""
    for i in range(len(x)):
        at = -800.0 if x[i] < -800.0 else x[i]
        n = np.rint(at * (1.0 / _LN2))
        r, value = at - n * _LN2, 0.0
        for coefficient in _EXPONENTIAL:
            value = value * r + coefficient
        x[i] = math.ldexp(value, int(n))
