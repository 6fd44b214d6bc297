# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The two ends of an element: what belongs to each, what drives it, and what both do then.

An end follows a prescribed motion: a pulse, a move, or what a kick makes it do. A `Shot` is one
pulse into a resting element with its waveforms, which a `WaveformRecorder` takes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Protocol

import numpy as np

from ..physics import Design
from ..physics.formulas import cosine, exponential, sine
from ..physics.values import Array

if TYPE_CHECKING:
    from ..settings import ProbeSettings, Settings


class End(str, Enum):
    """An end at which an element is driven and probed; its value is used in files and answers."""

    LEFT = 'left'
    RIGHT = 'right'

    def __str__(self) -> str:
        return self.value

    @property
    def row(self) -> int:
        """Its row in arrays of both ends, shape (2, ...)."""
        return 0 if self is End.LEFT else 1

    @property
    def opposite(self) -> End:
        """The other end."""
        return End.RIGHT if self is End.LEFT else End.LEFT

    def site(self, design: Design) -> int:
        """Return its cell: 1 or N."""
        return 1 if self is End.LEFT else design.N

    def k_s(self, design: Design) -> float:
        """Return the on-site stiffness of that state, in which its waves travel."""
        return design.k_s2 if self is End.LEFT else design.k_s1

    def distance(self, design: Design, level: int) -> int:
        """Return how far a wall at a level is, in cells."""
        return abs(design.defect_site(level) - self.site(design))

    def cell(self, design: Design, distance: float) -> float:
        """Return the place of a reflector that is at some distance from it."""
        return 1.0 + distance if self is End.LEFT else design.N - distance

    def find_displacement(self, design: Design, strain: float) -> float:
        """Return how far a substrate strain moves it."""
        return 0.0 if self is End.LEFT else design.end_displacement(strain)

    def select_probe(self, settings: Settings) -> ProbeSettings:
        """Return its pulse and detector, which depend on how walls are written."""
        probe = settings.probe if self is End.LEFT else settings.probe_right
        return settings.read.amplify_probe(probe) if settings.amplifies_pulses else probe


@dataclass(frozen=True, eq=False)
class Shot:
    """One pulse and its waveforms, in the instrument's own units of time and length.

    Attributes:
        end: The driven end.
        omega_c, A, sigma: Carrier, amplitude and envelope of the pulse; see `Pulse`.
        wall: Site near which the wall is supposed to rest, 0 for a blank element.
        strain: Strain of the element, held.
        dt: Time between samples.
        rest: Displacement of both ends before the pulse, shape (2,).
        samples: Displacement of both ends from dt after the pulse began, shape (2, n); NaN where
            there is none.
        unrest: Root mean square departure of the noisier end from its rest before the pulse.
    """

    end: End
    omega_c: float
    A: float
    sigma: float
    wall: float
    strain: float
    dt: float
    rest: Array
    samples: Array
    unrest: float = 0.0

    @property
    def pulse(self) -> Pulse:
        """The motion of the driven end, about 0."""
        return Pulse(0.0, self)


class PulseShape(Protocol):
    """What shapes a pulse."""

    @property
    def omega_c(self) -> float:
        """Carrier frequency in rad per time unit."""

    @property
    def A(self) -> float:
        """Amplitude in cells."""

    @property
    def sigma(self) -> float:
        """Standard deviation of the envelope in time units."""


class BoundaryMotion(Protocol):
    """A motion that an end can be made to follow; then it is released."""

    @property
    def duration(self) -> float:
        """Time for which the cell is held, in time units."""

    def evaluate_motion(self, t: Array) -> Array:
        """Return displacement and velocity at times t, stacked: shape (2,) + t.shape."""


@dataclass(frozen=True)
class Pulse:
    """The Gaussian-modulated harmonic pulse about a rest displacement (page 5)."""

    rest: float
    probe: PulseShape

    @property
    def t_0(self) -> float:
        """Centre of the envelope: 6 sigma."""
        return 6.0 * self.probe.sigma

    @property
    def duration(self) -> float:
        """Time for which the cell is held, in time units: 2 t_0."""
        return 2.0 * self.t_0

    def evaluate_motion(self, t: Array) -> Array:
        """Return displacement and velocity at times t, stacked: shape (2,) + t.shape."""
        p = self.probe
        x = (t - self.t_0) / p.sigma
        envelope = p.A * exponential(-0.5 * x * x)
        wave, slope = sine(p.omega_c * t), p.omega_c * cosine(p.omega_c * t)
        return np.stack((self.rest + envelope * wave, envelope * (slope - x / p.sigma * wave)))


@dataclass(frozen=True)
class EndMove:
    """A move at constant speed from one displacement to another."""

    start: float
    target: float
    speed: float

    @property
    def duration(self) -> float:
        """Time the move takes."""
        return abs(self.target - self.start) / self.speed

    def evaluate_motion(self, t: Array) -> Array:
        """Return displacement and velocity at times t."""
        velocity = math.copysign(self.speed, self.target - self.start)
        return np.stack((self.start + velocity * t, np.full_like(t, velocity)))


class WaveformRecorder:
    """Records both ends from now on, where a pulse begins."""

    def __init__(self, end: End, probe: ProbeSettings, before: Array, lag: int) -> None:
        """Begin with the samples that are taken `lag` ticks from now.

        `before` holds displacements of both ends before the pulse, shape (2, n).
        """
        self.end, self.probe = end, probe
        self._rest, self._unrest = before.mean(axis=1), float(before.std(axis=1).max())
        self._late = lag
        self._parts: list[Array] = []
        self._broken = False

    def take_samples(self, ends: Array, ticks: int, interrupted: bool) -> None:
        """Take the samples of ticks, shape (2, m).

        From an interruption on, when they were taken is not known: they are NaN.
        """
        late = min(self._late, ticks)
        self._late -= late
        self._broken |= interrupted
        part = ends[:, late * ends.shape[1] // ticks :]
        self._parts.append(np.full_like(part, np.nan) if self._broken else part)

    def shot(self, wall: float, strain: float, dt: float) -> Shot:
        """Return the pulse and all samples so far; see `Shot`."""
        probe, samples = self.probe, np.concatenate((np.empty((2, 0)), *self._parts), axis=1)
        return Shot(
            self.end, probe.omega_c, probe.A, probe.sigma, wall, strain, dt, self._rest, samples,
            self._unrest,
        )  # fmt: skip
