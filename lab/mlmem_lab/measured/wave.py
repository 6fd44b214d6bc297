# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The forward model: a chain of shells and magnets, its first element pushed over by hand.

The on-site energy is that of a bistable shell between rails, as its authors measured and fitted
it. The rails pre-compress a shell, and the more they do, the farther off is its second well. A
shell whose well is not at one of the three measured places is a blend of the two measured energies
beside it, each stretched to the well: a family with one parameter, the prestrain.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from mlmem.physics import NOH_BATHE, HeldCell, Integrator, substep_times
from mlmem.physics.potential import Array

from ..lattices import Friction, Lattice, Pieces, PowerLaw, Wells
from . import runs
from .runs import Case

POLYNOMIAL_DEGREE = 4


@dataclass(frozen=True, eq=False)
class Shell:
    """A bistable shell.

    Attributes:
        energy: On-site energy of the displacement in cm; 0.1 J.
        well: Its second well, cm.
    """

    energy: Pieces
    well: float

    def gain(self) -> float:
        """Return the energy that a passage from the first to the second well sets free, 0.1 J."""
        middles = (np.arange(20_000) + 0.5) / 20_000 * self.well
        return float(-self.well * self.energy.derivative(middles, 1).mean())


def _measured_shell(edges: tuple[float, float], well: float, *pieces: tuple[float, ...]) -> Shell:
    filled = [np.pad(piece, (0, POLYNOMIAL_DEGREE + 1 - len(piece))) for piece in pieces]
    return Shell(Pieces(np.array(filled), np.array(edges)), well)


MEASURED_SHELLS = {
    21.5: _measured_shell(
        (1.75, 5.229), 6.264,
        (0.0, 0.0, 0.0256743, -0.00489034),
        (0.10991, -0.204049, 0.160139, -0.040711, 0.00291668),
        (-0.809805, 4.92206, -0.979682, 0.0624519),
    ),
    22.0: _measured_shell(
        (1.091, 3.81635), 5.270,
        (0.0, 0.0, 0.0593034, -0.018119),
        (0.0216472, -0.0664308, 0.132853, -0.0521944, 0.00531799),
        (-0.815088, 0.886911, -0.271859, 0.0237451),
    ),
    22.5: _measured_shell(
        (1.104, 2.61696), 3.971,
        (0.0, 0.0, 0.0402355, -0.0121484),
        (0.139316, -0.416266, 0.48557, -0.208458, 0.0280114),
        (-0.142865, 0.409241, -0.213546, 0.0272003),
    ),
}  # fmt: skip
"""The authors' energies, by the distance of the rails in cm. (Their additive constants do not
join: the third piece at 21.5 lies 7.3 too high. Only slopes matter, and those do.)"""


@cache
def build_shell(well: float) -> Shell:
    """Return the shell whose second well is at a place, in cm.

    It has five pieces, however few differ. Beyond the outermost measured wells the blend is
    extrapolated.
    """
    known = sorted(MEASURED_SHELLS.values(), key=lambda each: each.well)
    low, high = known[:2] if well < known[1].well else known[1:]
    share = (well - low.well) / (high.well - low.well)
    scaled = [
        (1.0 - share, well / low.well, low.energy),
        (share, well / high.well, high.energy),
    ]
    edges = np.sort(np.concatenate([each.edges * stretch for _, stretch, each in scaled]))
    middles = np.concatenate(([edges[0] - 1.0], 0.5 * (edges[1:] + edges[:-1]), [edges[-1] + 1.0]))
    coefficients = np.zeros((len(middles), POLYNOMIAL_DEGREE + 1))
    for weight, stretch, each in scaled:
        piece = each.coefficients[np.searchsorted(each.edges, middles / stretch)]
        coefficients += weight * piece / stretch ** np.arange(POLYNOMIAL_DEGREE + 1)
    return Shell(Pieces(coefficients, edges), well)


ELEMENT_COUNT = 25
ELEMENT_MASS = 21.0
A, POWER = 17.51805, -3.2744
"""Magnets at a distance r in cm repel with A r^POWER, in 10 N."""

MIN_MAGNET_DISTANCE_CM = 0.3
"""Distance in cm below which the magnets' law is held constant."""

CREEP_SPEED = 0.002
"""Velocity below which dry friction is viscous, cm/ms."""

HAND_TIME_MS = 25.0
"""Time in ms that the hand takes, about that of a neighbour's snap. It is not known."""

TIME_STEP_MS = 0.2
"""ms; half of it changes speeds by less than 0.1 %."""

SAMPLE_PERIOD_MS = 2.0
"""Time between two looks, ms; arrivals are interpolated."""

MAX_IDLE_SPEED = 1e-5
"""No element is faster than this, in cm/ms: the wave has stopped."""

MAX_WAVE_TIME_MS = 1500.0
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
        return np.array(
            [runs.first_crossing(self.t, self.u[:, j], 0.5 * self.wells[j]) for j in tracked]
        )

    @property
    def speed(self) -> float:
        """Mean speed over the tracked elements, m/s; NaN if the wave does not pass them."""
        return runs.mean_speed(self.case, self.arrivals)

    @property
    def rise(self) -> Array:
        """Their times from a tenth to nine tenths of the way, ms, shape (4,)."""
        tracked = range(FIRST, LAST + 1)
        return np.array([runs.rise_time(self.t, self.u[:, j], self.wells[j]) for j in tracked])


def launch_wave(
    case: Case,
    shells: Shell | Sequence[Shell],
    losses: Losses,
    bias: Array | float = 0.0,
    hand: float = HAND_TIME_MS,
    last: int = LAST,
    integrator: Integrator = NOH_BATHE,
    dt: float = TIME_STEP_MS,
) -> Wave:
    """Push the first element over and return what follows.

    Args:
        case: The lattice.
        bias: A constant force on each element and the end, against the wave, 10 N; one number or
            shape (26,).
        hand: Time the hand takes, ms.
        last: Element that ends the run when it has reached its well, or all have come to rest.
        dt: Step, ms.
    """
    each = [shells] * ELEMENT_COUNT if isinstance(shells, Shell) else list(shells)
    each.append(each[-1])  # the end of the chain, which is held
    wells = np.array([one.well for one in each])
    lattice = Lattice(
        Wells([one.energy for one in each], np.broadcast_to(bias, ELEMENT_COUNT + 1)),
        PowerLaw(A, POWER, case.spacing, MIN_MAGNET_DISTANCE_CM),
        np.full(ELEMENT_COUNT + 1, ELEMENT_MASS),
        dt,
        damping=ELEMENT_MASS * losses.damping,
        friction=Friction(losses.friction, CREEP_SPEED),
        held=(ELEMENT_COUNT + 1,),
        integrator=integrator,
    )
    every, u = round(SAMPLE_PERIOD_MS / dt), [lattice.displacement.copy()]
    while lattice.time < MAX_WAVE_TIME_MS:
        driven = substep_times(every, dt, integrator, lattice.steps_done)
        lattice.advance(every, HeldCell(1, _hand_motion(driven, hand, wells[0])))
        u.append(lattice.displacement.copy())
        if lattice.time > hand and (
            u[-1][last] > wells[last] or np.abs(lattice.velocity).max() < MAX_IDLE_SPEED
        ):
            break
    t = np.arange(len(u), dtype=np.float64) * SAMPLE_PERIOD_MS
    return Wave(case, wells[:-1], t, np.array(u)[:, :-1])


def _hand_motion(t: Array, hand: float, well: float) -> Array:
    """Return where the hand holds the first element, and how fast it moves it, shape (2, m)."""
    x = np.minimum(t / hand, 1.0)
    return np.array((well * x * x * (3.0 - 2.0 * x), well * 6.0 * x * (1.0 - x) / hand))
