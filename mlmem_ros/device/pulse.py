# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Prescribed motions of a boundary cell: pulses that probe or push; moves and kicks."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..physics.portable import cosine, exponential, sine
from ..physics.potential import Array
from .settings import KickSettings, ProbeSettings, PushSettings


@dataclass(frozen=True)
class Pulse:
    """The Gaussian-modulated harmonic pulse about a rest displacement (page 5).

    Attributes:
        rest: Displacement of the cell at rest.
        probe: Carrier, amplitude and envelope.
    """

    rest: float
    probe: ProbeSettings | PushSettings

    @property
    def t_0(self) -> float:
        """Centre of the envelope: 6 sigma."""
        return 6.0 * self.probe.sigma

    @property
    def duration(self) -> float:
        """Time for which the cell is held, in time units: 2 t_0."""
        return 2.0 * self.t_0

    def at(self, t: Array) -> Array:
        """Return displacement and velocity at times t, stacked: shape (2,) + t.shape."""
        p = self.probe
        x = (t - self.t_0) / p.sigma
        envelope = p.A * exponential(-0.5 * x * x)
        wave, slope = sine(p.omega_c * t), p.omega_c * cosine(p.omega_c * t)
        return np.stack((self.rest + envelope * wave, envelope * (slope - x / p.sigma * wave)))


@dataclass(frozen=True)
class Move:
    """A move at constant speed from one displacement to another."""

    start: float
    target: float
    speed: float

    @property
    def duration(self) -> float:
        """Time the move takes."""
        return abs(self.target - self.start) / self.speed

    def at(self, t: Array) -> Array:
        """Return displacement and velocity at times t."""
        velocity = math.copysign(self.speed, self.target - self.start)
        return np.stack((self.start + velocity * t, np.full_like(t, velocity)))


@dataclass(frozen=True)
class Kick:
    """A smooth move from one ground state to the other, which launches a wall; its mean speed
    selects the level at which that stops.

    It is 3 x^2 - 2 x^3 of a clock x that itself begins slowly: (1 - late) s + late s^2.

    Attributes:
        start: Displacement at the beginning.
        target: Displacement at the end.
        speed: Mean speed; the highest is `shape.fastest` times that.
        shape: How late it is fastest, and how long the cell is held at its target.
    """

    start: float
    target: float
    speed: float
    shape: KickSettings

    @property
    def duration(self) -> float:
        """Time for which the cell is held, in time units."""
        return abs(self.target - self.start) / self.speed + self.shape.hold

    def at(self, t: Array) -> Array:
        """Return displacement and velocity at times t."""
        way, late = self.target - self.start, self.shape.late
        rate = self.speed / abs(way) if way else 0.0
        s = np.minimum(t * rate, 1.0)
        x, clock = s + late * s * (s - 1.0), 1.0 + late * (2.0 * s - 1.0)
        return np.stack(
            (self.start + way * x * x * (3.0 - 2.0 * x), 6.0 * way * rate * x * (1.0 - x) * clock)
        )


BoundaryMotion = Pulse | Move | Kick
"""The motions that a boundary cell can be made to follow; then it is released."""
