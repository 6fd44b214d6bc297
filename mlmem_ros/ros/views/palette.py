# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The colours of a configuration, as in the paper: red for s1, blue for s2, white in between."""

from __future__ import annotations

import numpy as np

from ...physics import Design
from ...physics.potential import Array

RED, WHITE, BLUE = (178, 24, 43), (247, 247, 247), (33, 102, 172)

OVERSHOOT = 0.2
"""How far the scale reaches beyond either phase, in distances between the phases."""

_STOPS = np.array((RED, WHITE, BLUE), dtype=np.float64).T
COLOURS = np.stack(
    [np.interp(np.linspace(0.0, 2.0, 256), range(3), stop) for stop in _STOPS], axis=1
).astype(np.uint8)
"""Red, green and blue of every index, shape (256, 3)."""


class Palette:
    """Turns configurations of one design into indices of `COLOURS`."""

    def __init__(self, design: Design) -> None:
        span = design.D_s2 - design.D_s1
        self._low = design.D_s1 - OVERSHOOT * span
        self._scale = 255.0 / ((1.0 + 2.0 * OVERSHOOT) * span)

    def indices(self, configuration: Array) -> np.ndarray:
        """Return the index of each value's colour, clipped to the scale."""
        return np.clip((configuration - self._low) * self._scale, 0.0, 255.0).astype(np.uint8)
