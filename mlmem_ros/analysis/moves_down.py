# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Strokes and throws on the bare chain, and closed forms for how far they carry a wall.

The wall as a particle (see `rolling_wall`) has the mass M; its place X, seen from the substrate,
is pushed by -B X e'' when the strain e changes its rate: B = sum of dv_j / dX = D_s2 - D_s1, for
the substrate of cell j moves by j e. Both forms leave out pins, gradient and waves.
"""

from __future__ import annotations

import math

import numpy as np

from ..device.motion import SMOOTH_PEAK_RATE, Cycle
from ..device.reading import BLANK, UNDECODABLE
from ..physics import Chain, Design, Specimen, StateError, level_of, stable_step, substep_times
from ..physics.equilibrium import resting_wall, wall_profile
from ..physics.potential import Array

STEP = 0.5
"""Time step; the wall's own motion is a hundred times slower."""

REST = 2500.0
"""Ten damping times: a wall that swings about its defect has then come to rest."""


def moved(
    design: Design, cycle: Cycle, level: int, *, rest: float = REST, dt: float = STEP
) -> int:
    """Return the level after a cycle and a rest, `BLANK`, or `UNDECODABLE` for anything else.

    For the arguments see `left_by`.
    """
    left = left_by(Specimen(design), cycle, level, rest=rest, dt=dt)
    return UNDECODABLE if left is None else level_of(design, left)


def left_by(
    specimen: Specimen, cycle: Cycle, level: int, *, rest: float = REST, dt: float = STEP
) -> Array | None:
    """Return the configuration after a cycle and a rest, shape (N,); None for a lost chain.

    Args:
        specimen: The element.
        cycle: The strain.
        level: Where the wall starts, or `BLANK`.
        rest: Time units after the cycle.
        dt: Time step, where it is stable.
    """
    design = specimen.design
    chain = Chain(design, min(dt, 0.95 * stable_step(specimen)))
    chain.become(specimen)
    times = substep_times(round(cycle.duration / chain.dt), chain.dt, chain.integrator)
    try:
        if level != BLANK:
            chain.place(resting_wall(specimen, level))
        chain.advance(cycle.strain(times) * design.end_displacement(1.0))
        chain.rest(round(rest / chain.dt))
    except StateError:  # strained so hard that the chain diverges, or no wall rests there
        return None
    return chain.configuration


def inertia_over_mass(design: Design) -> float:
    """Return B / M of a wall: its throw relative to its position, per unit of strain."""
    middle = 0.5 * design.N
    profile = wall_profile(design, middle)
    slope = np.gradient(profile)
    return float((design.D_s2 - design.D_s1) / np.sum(slope**2))


def reach(design: Design, peak: float, ease: float) -> float:
    """Return how far a throw carries a wall, relative to its position; from 1 on it leaves.

    Released over a time `ease`, the strain falls at SMOOTH_PEAK_RATE peak / ease at its fastest.
    The well that the strain makes holds the wall until then; the substrate's deceleration sets the
    wall moving at B / M X times that rate, and damping ends the flight after 1 / eta.
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


def stroke_swing(design: Design, start: int, levels: int) -> float:
    """Return the sudden rise in strain that moves a wall down by some levels.

    A wall stays behind when the substrate moves fast: X falls to X exp(-B / M e).

    Args:
        design: The element.
        start: Level at which the wall is.
        levels: How many levels down.
    """
    place = design.defect(start)
    return math.log(place / (place - levels * design.J)) / inertia_over_mass(design)
