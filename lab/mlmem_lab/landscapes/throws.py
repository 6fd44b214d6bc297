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

from mlmem_ros.device.motion import SMOOTH_PEAK_RATE
from mlmem_ros.physics import Design


def inertia_over_mass(design: Design) -> float:
    """Return B / M of a wall: its throw relative to its position, per unit of strain."""
    D = np.linspace(design.D_s1, design.D_s2, 2001)
    # At rest v'^2 / 2 = psi, so M, the integral of v'^2 over X, is that of sqrt(2 psi) over D.
    return float(1.0 / np.mean(np.sqrt(2.0 * design.potential.energy(D))))


def reach(design: Design, change: float, ease: float) -> float:
    """Return how far a throw carries a wall, relative to its position; from 1 on it leaves.

    Let go by a change of strain, (1 - ease_to) peak, over a time `ease`, the strain falls at
    SMOOTH_PEAK_RATE change / ease at its fastest.
    Until then the well that the strain makes holds the wall. The substrate's deceleration then
    sets the wall moving at B / M X times that rate, and damping ends the flight after 1 / eta.
    """
    rate = SMOOTH_PEAK_RATE * abs(change) / ease
    return inertia_over_mass(design) * rate / design.eta


def shortest_ease(design: Design, change: float) -> float:
    """Return the release time below which all cells of the far end slip to a third state.

    The deceleration of the substrate at cell N pushes that cell by 6 N change / ease^2, with the
    change of strain from the peak, (1 - ease_to) peak, and the slope of the potential below the
    inactive phase holds it.
    """
    below = np.linspace(design.wells[0] - 2.0, design.D_s1, 2001)
    holds = float(design.alpha.min() * np.max(-design.potential.slope(below)))
    return math.sqrt(6.0 * design.N * abs(change) / holds)
