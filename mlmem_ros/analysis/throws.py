# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Closed forms for a throw: how far it carries a wall, and how fast it may let go.

The wall is taken as a particle (see `rolling_wall`) of mass M. The substrate of cell j moves by
j e, so a strain e that changes its rate pushes a wall at X by -B X e'', with
B = sum of dv_j / dX = D_s2 - D_s1. Pins, gradient and waves are left out.
"""

from __future__ import annotations

import math

import numpy as np

from ..device.motion import SMOOTH_PEAK_RATE
from ..physics import Design
from ..physics.equilibrium import wall_profile


def inertia_over_mass(design: Design) -> float:
    """Return B / M of a wall: its throw relative to its position, per unit of strain."""
    slope = np.gradient(wall_profile(design, 0.5 * design.N))
    return float((design.D_s2 - design.D_s1) / np.sum(slope**2))


def reach(design: Design, peak: float, ease: float) -> float:
    """Return how far a throw carries a wall, relative to its position; from 1 on it leaves.

    Released over a time `ease`, the strain falls at SMOOTH_PEAK_RATE peak / ease at its fastest.
    Until then the well that the strain makes holds the wall. The substrate's deceleration then
    sets the wall moving at B / M X times that rate, and damping ends the flight after 1 / eta.
    """
    rate = SMOOTH_PEAK_RATE * abs(peak) / ease
    return inertia_over_mass(design) * rate / design.eta


def shortest_ease(design: Design, peak: float) -> float:
    """Return the release time below which all cells of the far end slip to a third state.

    The deceleration of the substrate at cell N pushes that cell by 6 N peak / ease^2, and the
    slope of the potential below the inactive phase holds it.
    """
    below = np.linspace(design.wells[0] - 2.0, design.D_s1, 2001)
    holds = float(design.alpha.min() * np.max(-design.potential.slope(below)))
    return math.sqrt(6.0 * design.N * abs(peak) / holds)
