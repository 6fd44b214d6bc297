# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The path from the actuator's commanded strain to the strain of the substrate.

Command -> motor (may be stuck or lag; read by the encoder) -> grip (may slip or be mounted askew)
-> substrate. Each follows the one before it and makes up a difference no faster than a strain that
is set by hand. So a fault that comes or goes does not jerk cells out of their phase, as a
compression by 0.1 would at the rate of a throw.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..physics.portable import exponential
from ..physics.potential import Array
from ..rng import Stream, happens
from .faults import Faults
from .settings import ActuatorSettings

NO_LAG = 1e-9
"""Shortest time constant of a lag."""


@dataclass(frozen=True)
class TransmissionState:
    """The state of the transmission.

    Attributes:
        commanded: The last commanded strain.
        encoder_strain: Strain of the motor, read by the encoder.
        strain: Strain of the substrate.
        slipping: Whether the grip slips during the present strain cycle.
    """

    commanded: float = 0.0
    encoder_strain: float = 0.0
    strain: float = 0.0
    slipping: bool = False

    @property
    def true(self) -> bool:
        """Whether the substrate has the commanded strain."""
        return self.commanded == self.encoder_strain == self.strain and not self.slipping


class Transmission:
    """Passes the strain on; exactly, if there is no fault.

    Attributes:
        state: Its state.
    """

    def __init__(self, settings: ActuatorSettings) -> None:
        """Link an actuator to a substrate, unstrained."""
        self.state = TransmissionState()
        self._settings = settings

    @property
    def encoder(self) -> float:
        """Strain of the motor; the device cannot read that of the substrate."""
        return self.state.encoder_strain

    def advance(self, commanded: Array, dt: Array, faults: Faults, tick: int) -> Array:
        """Return the strain of the substrate at the end of every sub-step of a tick, shape (m,).

        Without a fault, and if the transmission is true, it may be a run of ticks. `commanded` is
        the commanded strain, shape (m,), and `dt` has the lengths of the sub-steps.
        """
        state, last = self.state, float(commanded[-1])
        slipping = self._slips(commanded, faults, tick)
        faulty = slipping or faults.actuator_stuck or faults.actuator_lag or faults.actuator_offset
        if state.true and not faulty:
            if last != state.commanded:
                self.state = TransmissionState(last, last, last)
            return commanded
        motor = self._driven(commanded, dt, faults)
        wanted = np.zeros_like(motor) if slipping else motor
        limits = self._limits(wanted, 0.0 if slipping else state.encoder_strain, dt)
        strain = _followed(state.strain, wanted + faults.actuator_offset, limits)
        slipping = slipping and bool(commanded.any())  # the grip holds again after the cycle
        self.state = TransmissionState(last, float(motor[-1]), float(strain[-1]), slipping)
        return strain

    def _slips(self, commanded: Array, faults: Faults, tick: int) -> bool:
        """Return whether the grip slips: drawn when a cycle leaves zero, kept until it returns."""
        may_slip = faults.missed_cycle > 0.0 or self.state.slipping
        if may_slip and self.state.commanded == 0.0 and commanded.any():
            return happens(faults.missed_cycle, faults.seed, tick, Stream.SLIP)
        return self.state.slipping

    def _driven(self, commanded: Array, dt: Array, faults: Faults) -> Array:
        """Return the strain of the motor at the end of every sub-step."""
        start = self.state.encoder_strain
        if faults.actuator_stuck:
            return np.full_like(commanded, start)
        limits, share = self._limits(commanded, self.state.commanded, dt), None
        if faults.actuator_lag:
            share = 1.0 - exponential(-dt / max(faults.actuator_lag, NO_LAG))
        return _followed(start, commanded, limits, share)

    def _limits(self, course: Array, before: float, dt: Array) -> Array:
        """Return the largest changes down and up in each sub-step, shape (2, m).

        The change of the course itself plus one by hand, within the rate limit of the actuator.
        """
        moves = np.diff(course, prepend=before)
        by_hand, most = self._settings.by_hand * dt, self._settings.max_rate * dt
        down = np.maximum(np.minimum(moves, 0.0) - by_hand, -most)
        up = np.minimum(np.maximum(moves, 0.0) + by_hand, most)
        return np.array((down, up))


def _followed(start: float, wanted: Array, limits: Array, share: Array | None = None) -> Array:
    """Return a path that follows a course, limited in each sub-step.

    Args:
        start: Where it starts.
        wanted: The course, shape (m,).
        limits: Largest changes down and up in each sub-step, shape (2, m).
        share: Fraction of the remaining way made in each sub-step, shape (m,); all by default.
    """
    followed = np.empty_like(wanted)
    at = start
    shares = np.ones_like(wanted) if share is None else share
    columns = (wanted.tolist(), *limits.tolist(), shares.tolist())
    for k, (goal, down, up, part) in enumerate(zip(*columns, strict=True)):
        way = part * (goal - at)
        if down <= way <= up:
            at = goal if part == 1.0 else at + way
        else:
            at += min(max(way, down), up)
        followed[k] = at
    return followed
