# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The on-site force (the potential of page 3) as the loops compute it: no branch, no table."""

from __future__ import annotations

import math

import numpy as np

from .jit import inlined

INVERSE_TURN = 0.5 / math.pi

# sin(2 pi h) / h on |h| <= 1/4 as a polynomial of degree 7 in z = h^2 (Remez fit in 50 digits:
# error 9e-17), by its zeros: -SCALE (z + Z0) and three factors z (z + Pi) + Qi. Factors can be
# computed side by side, where the terms of Horner's scheme wait for each other.
SCALE = 0.6909358876280237
Z0 = -1.3345852599441275
P1, Q1 = -1.2780920481684164, 0.2570229834847412
P2, Q2 = -2.6192657605531724, 3.1839719414663654
P3, Q3 = -0.29244421228863127, 8.326348824137952


@inlined
def wave(amplitude: float, turns: float) -> float:
    """Return amplitude sin(2 pi turns) / SCALE by a vectorisable polynomial; no branch, no table.

    Whole turns are taken off the distance to the sine's crest, which is exact; the rest is
    folded into the quarter turn beside a zero. The error of the sine is below 1e-15 plus the
    rounding of its argument.
    """
    crest = turns - 0.25
    whole: float = np.rint(crest)
    h = abs(crest - whole) - 0.25
    z = h * h
    near, far = (z + Z0) * (z * (z + P1) + Q1), (z * (z + P2) + Q2) * (z * (z + P3) + Q3)
    return amplitude * h * (near * far)


@inlined
def on_site(height: float, configuration: float, a: float, b: float, c: float) -> float:
    """Return height psi'(configuration) / d (the potential of page 3)."""
    y = configuration + c
    y2 = y * y
    turns = y * (INVERSE_TURN * a + INVERSE_TURN * b * y2)
    return wave(height * (SCALE * a + SCALE * 3.0 * b * y2), turns)
