# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The forward model: a chain of shells and magnets, its first element pushed over by hand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mlmem_ros.physics import NOH_BATHE, HeldCell, Integrator, substep_times
from mlmem_ros.physics.potential import Array

from ..lattices import Friction, Lattice, PowerLaw, Wells
from . import runs
from .runs import Case
from .shell import Shell

ELEMENTS = 25
MASS = 21.0
A, POWER = 17.51805, -3.2744
"""Magnets at a distance r in cm repel with A r^POWER, in 10 N."""

TOUCH = 0.3
"""Distance in cm below which the magnets' law is held constant."""

CREEP = 0.002
"""Velocity below which dry friction is viscous, cm/ms."""

HAND = 25.0
"""Time in ms that the hand takes, about that of a neighbour's snap. It is not known."""

STEP = 0.2
"""ms; half of it changes speeds by less than 0.1 %."""

LOOK = 2.0
"""Time between two looks, ms; arrivals are interpolated."""

STILL = 1e-5
"""No element is faster than this, in cm/ms: the wave has stopped."""

LONGEST = 1500.0
FIRST, LAST = 7, 10
"""The tracked elements, 8 to 11 counting the driven one as 1; from 0 here."""


@dataclass(frozen=True)
class Losses:
    """What slows the elements.

    Attributes:
        damping: Rate of the viscous drag, per ms.
        friction: Dry friction in 10 N.
    """

    damping: float
    friction: float = 0.0


@dataclass(frozen=True)
class Wave:
    """Displacements of all elements as a wave runs down the chain.

    Attributes:
        case: The lattice.
        wells: Second well of each element, cm, shape (25,).
        t: Times, ms, shape (m,).
        u: Displacements, cm, shape (m, 25).
    """

    case: Case
    wells: Array
    t: Array
    u: Array

    @property
    def arrivals(self) -> Array:
        """When the tracked elements pass half their way, ms, shape (4,); NaN for never."""
        tracked = range(FIRST, LAST + 1)
        return np.array([runs.first(self.t, self.u[:, j], 0.5 * self.wells[j]) for j in tracked])

    @property
    def speed(self) -> float:
        """Mean speed over the tracked elements, m/s; NaN if the wave does not pass them."""
        return runs.speed(self.case, self.arrivals)

    @property
    def rise(self) -> Array:
        """Their times from a tenth to nine tenths of the way, ms, shape (4,)."""
        tracked = range(FIRST, LAST + 1)
        return np.array([runs.rise(self.t, self.u[:, j], self.wells[j]) for j in tracked])


def launch(
    case: Case,
    shells: Shell | Sequence[Shell],
    losses: Losses,
    bias: Array | float = 0.0,
    hand: float = HAND,
    longest: float = LONGEST,
    last: int = LAST,
    integrator: Integrator = NOH_BATHE,
    dt: float = STEP,
) -> Wave:
    """Push the first element over and return what follows.

    Args:
        case: The lattice.
        shells: One for all elements, or one each.
        losses: What slows them.
        bias: A constant force on each element and the end, against the wave, 10 N; one number or
            shape (26,).
        hand: Time the hand takes, ms.
        longest: When to stop, ms.
        last: Element that ends the run when it has reached its well, or all have come to rest.
        integrator: How the chain is stepped.
        dt: Step, ms.
    """
    each = [shells] * ELEMENTS if isinstance(shells, Shell) else list(shells)
    each.append(each[-1])  # the end of the chain, which is held
    wells = np.array([one.well for one in each])
    lattice = Lattice(
        Wells([one.energy for one in each], np.broadcast_to(bias, ELEMENTS + 1)),
        PowerLaw(A, POWER, case.spacing, TOUCH),
        np.full(ELEMENTS + 1, MASS),
        dt,
        damping=MASS * losses.damping,
        friction=Friction(losses.friction, CREEP),
        held=(ELEMENTS + 1,),
        integrator=integrator,
    )
    every, u = round(LOOK / dt), [lattice.displacement.copy()]
    while lattice.time < longest:
        driven = substep_times(every, dt, integrator, lattice.steps_done)
        lattice.advance(every, HeldCell(1, _held(driven, hand, wells[0])))
        u.append(lattice.displacement.copy())
        if lattice.time > hand and (
            u[-1][last] > wells[last] or np.abs(lattice.velocity).max() < STILL
        ):
            break
    t = np.arange(len(u), dtype=np.float64) * LOOK
    return Wave(case, wells[:-1], t, np.array(u)[:, :-1])


def _held(t: Array, hand: float, well: float) -> Array:
    """Return where the hand holds the first element, and how fast it moves it, shape (2, m)."""
    x = np.minimum(t / hand, 1.0)
    return np.array((well * x * x * (3.0 - 2.0 * x), well * 6.0 * x * (1.0 - x) / hand))
