# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The transducers at both ends: hold or free a boundary cell, and sense its displacement."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..physics import Design, Drive, substep_times
from ..physics.dispersion import band
from ..physics.potential import Array
from .driver import Driver
from .echo import FAINTEST, EchoDetector
from .end import End
from .errors import SettingsError
from .pulse import BoundaryMotion, Move, Pulse
from .settings import Settings

REST_PERIODS = 8.0
"""Periods of the slowest carrier over which the rest displacement is averaged."""

LEFT_OF_MOTION = 1e-3
"""Fraction of the fastest motion left in the difference of samples that measures noise."""

MOST_SAMPLES = 1_000_000
"""Most samples kept of an end."""

HIGHEST_DIFFERENCE = 24
"""Highest order: beyond, samples are too far apart to distinguish motion from noise."""


class Held(NamedTuple):
    """A held boundary cell: its prescribed motion, its site, and the steps done."""

    motion: BoundaryMotion
    site: int
    steps: int


class Transducer:
    """Drives and senses the first and the last cell of a chain.

    Attributes:
        recent: Last displacements of both ends, shape (2, w), newest last. They give the rest
            displacement, and show whether the element is quiet.
        detector: Detector for the last pulse, or None.
        held: The held boundary cell, or None.
        interrupted: Whether listening was interrupted since the pulse.
    """

    def __init__(self, design: Design, settings: Settings, driver: Driver) -> None:
        """Fit transducers to the ends of an element.

        Raises:
            SettingsError: A carrier is so slow that too many samples would have to be kept.
        """
        self._design = design
        self._driver = driver
        self.probes = {end: end.probe(settings) for end in End}
        slowest = min(probe.omega_c for probe in self.probes.values())
        dt = driver.dt
        width = 2.0 * math.pi * REST_PERIODS / slowest
        self._difference = _difference(upper_edge(design), dt)
        samples = max(math.ceil(width / dt), self._difference + 1)
        if samples > MOST_SAMPLES:
            raise SettingsError(
                f'omega_c must be at least {slowest * samples / MOST_SAMPLES:.4g} with steps of '
                f'{dt:.4g}, or the rest displacement needs more than {MOST_SAMPLES} samples; '
                f'got {slowest:g}'
            )
        self.recent: Array = np.empty((2, samples))
        self.settle()
        self.detector: EchoDetector | None = None
        self.interrupted = False
        self._late = 0  # ticks still to come of samples from before the pulse
        self._listening_end = End.LEFT
        self._rest = 0.0
        self.held: Held | None = None

    @property
    def driving(self) -> bool:
        """Whether a boundary cell is held."""
        return self.held is not None

    @property
    def left(self) -> float:
        """Time until the held cell is released; 0 if none is held."""
        if self.held is None:
            return 0.0
        return self.held.motion.duration - self.held.steps * self._driver.dt

    @property
    def busy(self) -> bool:
        """Whether a cell is held or a detector is listening."""
        return self.driving or self.detector is not None

    # --- sensing -------------------------------------------------------------------------

    def settle(self) -> None:
        """Assume that both ends have rested where they are."""
        for end in End:
            self.recent[end.row] = self._driver.end(end.site(self._design))

    def rest(self, end: End) -> float:
        """Return the mean displacement of an end over the recent samples."""
        return float(self.recent[end.row].mean())

    def unrest(self, end: End) -> float:
        """Return the mean departure of an end from its rest over the recent samples."""
        samples = self.recent[end.row]
        return float(np.abs(samples - samples.mean()).mean())

    def noise(self, end: End) -> float:
        """Return the sensor's share of `unrest`: mean size of the noise in the recent samples.

        A difference of high enough order contains less than 0.1 % of a motion as fast as the pass
        bands allow, but all of a white noise. For Case II that is order 6 with samples 0.25 time
        units apart, and order 13 with 0.5.
        """
        differences = np.diff(self.recent[end.row], self._difference)
        return float(np.abs(differences).mean()) / _noise_gain(self._difference)

    @property
    def speed(self) -> float:
        """Speed of the first cell."""
        if (chain := self._driver.chain) is not None:
            return float(chain.velocity[0])
        return float(self.recent[0, -1] - self.recent[0, -2]) / self._driver.dt

    # --- driving -------------------------------------------------------------------------

    def fire(self, end: End, floor: float = 0.0, shaken: bool = False) -> EchoDetector:
        """Fire the probe pulse of an end, about its rest, and listen for the echo.

        `floor` is the contribution of noise alone to v_c, in cells. While the base shakes
        (`shaken`), the carrier is filtered.
        """
        detector = self.listen(end, floor, shaken)
        self._hold(end, Pulse(self._rest, self.probes[end]))
        return detector

    def listen(self, end: End, floor: float = 0.0, shaken: bool = False) -> EchoDetector:
        """Listen as after a pulse (see `fire`) without firing one."""
        self._rest = self.rest(end)
        self._listening_end = end
        least = FAINTEST * max(1.0, abs(self._rest))  # relative rounding
        self.interrupted, self._late = False, self._driver.lag
        self.detector = EchoDetector(self.probes[end], self._driver.dt, floor, least, shaken)
        return self.detector

    def move(self, end: End, target: float, speed: float) -> None:
        """Move a boundary cell at constant speed to a displacement, then release it."""
        start = self._driver.end(end.site(self._design))
        self._hold(end, Move(start, target, speed))

    def _hold(self, end: End, motion: BoundaryMotion) -> None:
        self.held = Held(motion, end.site(self._design), 0)

    def release(self) -> None:
        """Release a held cell, and stop listening."""
        self.held = None
        self.detector = None

    # --- the tick ------------------------------------------------------------------------

    def drive(self, steps: int) -> Drive | None:
        """Return the prescribed motion during the next steps, or None."""
        if self.held is None:
            return None
        motion, site, begun = self.held
        times = substep_times(steps, self._driver.dt, self._driver, begun)
        driven = times[times <= motion.duration]
        goes_on = len(driven) == len(times)
        self.held = Held(motion, site, begun + steps) if goes_on else None
        return Drive(site, motion.at(driven)) if len(driven) else None

    def record(self, ends: Array, ticks: int = 1, interrupted: bool = False) -> None:
        """Take the displacements of both ends after every step of ticks, shape (2, steps).

        `interrupted` says whether sampling was interrupted within them.
        """
        width = self.recent.shape[1]
        self.recent = np.concatenate((self.recent, ends), axis=1)[:, -width:]
        if self.detector is not None:
            self.interrupted |= interrupted
            late = min(self._late, ticks)
            self._late -= late
            if late < ticks:
                heard = ends[self._listening_end.row, late * ends.shape[1] // ticks :]
                self.detector.feed(heard - self._rest, ticks - late)


def _noise_gain(order: int) -> float:
    """Return the factor of a difference on white noise: the root sum square of its weights."""
    return math.sqrt(math.comb(2 * order, order))


def upper_edge(design: Design) -> float:
    """Return the upper edge of the pass bands, rounded up to a tenth."""
    stiffest = max(design.k_s1, design.k_s2) * float(design.alpha.max())
    return math.ceil(10.0 * band(stiffest)[1]) / 10.0


def _difference(omega: float, dt: float) -> int:
    """Return the least order of a difference of samples that removes motion but not noise.

    `omega` is the angular frequency of the fastest motion.
    """
    motion = 2.0 * math.sin(min(0.5 * omega * dt, 0.5 * math.pi))
    order = 1
    while motion**order > LEFT_OF_MOTION * _noise_gain(order) and order < HIGHEST_DIFFERENCE:
        order += 1
    return order
