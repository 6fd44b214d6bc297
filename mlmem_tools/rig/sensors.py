# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What an emulated rig measures with: units and zeros, and how far off it is."""

from __future__ import annotations

import math

import numpy as np

from mlmem_ros.device import SettingsError
from mlmem_ros.physics.potential import Array


class Sensors:
    """The transducers of both ends; each moves its end by what it measures.

    So a wrong gain makes the pulse smaller or larger, too.

    Attributes:
        unit: Unit of displacements, in cells.
        zero: Readings of the left and the right end at displacement 0, in that unit.
        gain: Displacements read over the true ones, of the left and the right end.
    """

    def __init__(
        self,
        unit: float = 1.0,
        zero: tuple[float, float] = (0.0, 0.0),
        gain: tuple[float, float] = (1.0, 1.0),
        *,
        noise: float = 0.0,
        jitter: float = 0.0,
        seed: int = 0,
    ) -> None:
        """Make sensors.

        Args:
            unit: Unit of displacements, in cells.
            zero: Readings at displacement 0, in that unit.
            gain: Displacements read over the true ones.
            noise: Standard deviation of a sample, in cells.
            jitter: Standard deviation of a sample's time, in samples.
            seed: Of the random numbers.

        Raises:
            SettingsError: A number is out of range.
        """
        if not (0.0 <= noise < math.inf and 0.0 <= jitter < math.inf and min(gain) > 0.0):
            raise SettingsError(
                'noise and jitter must be at least 0, and a gain above 0; got '
                f'{noise:g}, {jitter:g} and {min(gain):g}'
            )
        self.unit, self.zero, self.gain = unit, zero, gain
        self.noise, self.jitter = noise, jitter
        self._chance = np.random.default_rng(seed)

    def readings(self, ends: Array) -> Array:
        """Return what is read of displacements in cells, shape (2, n) both."""
        if self.jitter and ends.shape[1] > 1:
            late = self.jitter * self._chance.standard_normal(ends.shape)
            ends = ends + late * np.gradient(ends, axis=1)
        read = ends * np.array(self.gain)[:, None]
        if self.noise:
            read = read + self.noise * self._chance.standard_normal(read.shape)
        return np.asarray(read / self.unit + np.array(self.zero)[:, None])

    def held(self, site: int, motion: Array) -> Array:
        """Return the motion of a held end in cells, from set-points; shape (2, m) both."""
        end = 0 if site == 1 else 1
        zero = np.array([[self.zero[end]], [0.0]])
        return np.asarray((motion - zero) * self.unit / self.gain[end])
