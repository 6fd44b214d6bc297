# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A shot: one pulse into a resting element, and what both ends did after it."""

from __future__ import annotations

from dataclasses import dataclass

from ..physics.potential import Array
from .end import End
from .pulse import Pulse
from .settings import ProbeSettings


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
        return Pulse(0.0, ProbeSettings(omega_c=self.omega_c, A=self.A, sigma=self.sigma))
