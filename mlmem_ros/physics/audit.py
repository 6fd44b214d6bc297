# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An audit of the energy: what goes into a chain is stored there or becomes heat.

The books are kept from the Lagrangian alone (`energy` is their slow form), not from the
accelerations of the loops that they are to check.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .chain import Chain, Drive
from .jit import kernel
from .potential import Array

NEGLIGIBLE = 1e-9
"""Share of the stored energy below which an exchange is rounding and no measure."""


@dataclass(frozen=True)
class Budget:
    """Where the energy of a run came from and went to, in k_r (lattice constant)^2.

    Attributes:
        gained: Change of the stored energy.
        heat: What the damping took.
        actuator: Work on the substrate's end.
        held: Work on cells that are held: the driven one, and those that are stuck.
        shake: Work of the base's acceleration.
        stored: Energy of both chains at the end.
    """

    gained: float
    heat: float
    actuator: float
    held: float
    shake: float
    stored: float

    @property
    def residual(self) -> float:
        """What went in and is neither stored nor heat: lost by the integration, or made by it."""
        return self.actuator + self.held + self.shake - self.gained - self.heat

    @property
    def exchanged(self) -> float:
        """All that moved, without signs."""
        return self.heat + sum(map(abs, (self.gained, self.actuator, self.held, self.shake)))

    @property
    def imbalance(self) -> float:
        """The residual over what was exchanged, without sign."""
        measure = max(self.exchanged, NEGLIGIBLE * abs(self.stored))
        return abs(self.residual) / measure if measure else 0.0


def audit(
    chain: Chain,
    V_N: Array,
    drive: Drive | None = None,
    shake: Array | None = None,
    *,
    most: int | None = None,
) -> Budget:
    """Advance a chain, step by step, and keep books.

    Powers are integrated by the trapezoidal rule over the steps, of second order.

    Args:
        chain: It advances as by `Chain.advance`, which the other arguments are for, to the bit.
        V_N: Displacement of the substrate's end.
        drive: A cell held at a prescribed motion.
        shake: Acceleration of the base.
        most: Steps after which to stop; None for the whole run.

    Returns:
        The budget of these steps.

    Raises:
        StateError: As `Chain.advance`.
    """
    chain.check_inputs(V_N, drive, shake)
    substeps = chain.integrator.substeps
    V_N = V_N[: None if most is None else substeps * most]
    ledger = _Ledger(chain, 1 if drive is None else drive.site)
    driven = 0 if drive is None else drive.motion.shape[1]
    base = np.zeros(len(V_N)) if shake is None else shake
    before = ledger.entry(float(base[0]) if len(base) else 0.0)
    start = before.energy
    heat = actuator = held = shaken = 0.0
    for first in range(0, len(V_N), substeps):
        now = slice(first, first + substeps)
        part = Drive(drive.site, drive.motion[:, now]) if drive and first < driven else None
        chain.advance(V_N[now], part, base[now])
        after = ledger.entry(float(base[first + substeps - 1]))
        half = 0.5 * chain.dt
        heat += half * (before.damping + after.damping)
        held += half * (before.stuck + after.stuck)
        shaken += half * (before.shaking + after.shaking)
        actuator += 0.5 * (before.force + after.force) * (after.V_N - before.V_N)
        if part is not None:
            held += 0.5 * (before.pull + after.pull) * (after.position - before.position)
            held += after.kinetic - before.kinetic
        before = after
    return Budget(before.energy - start, heat, actuator, held, shaken, before.energy)


@dataclass(frozen=True)
class _Entry:
    """What the books need of one moment.

    Attributes:
        energy: Of both chains, without the motion of stuck cells.
        force: On the substrate's end.
        damping: Power of the damping.
        stuck: Power of what holds the stuck cells.
        shaking: Power of the base's acceleration.
        pull: Force on the driven cell beside its inertia.
        position, kinetic: Of the driven cell.
        V_N: Displacement of the substrate's end.
    """

    energy: float
    force: float
    damping: float
    stuck: float
    shaking: float
    pull: float
    position: float
    kinetic: float
    V_N: float


class _Ledger:
    """Makes entries for a chain."""

    def __init__(self, chain: Chain, site: int) -> None:
        specimen, design = chain.specimen, chain.design
        self._chain = chain
        self._cell = site - 1
        self._height = specimen.alpha * design.d
        self._offsets = np.array(specimen.offsets)
        self._springs = np.array(specimen.s)
        self._moving = np.isfinite(specimen.masses)
        self._masses = np.where(self._moving, specimen.masses, 0.0)
        # What of the substrate the actuator moves: its end site, or all of it, quasi-statically.
        elastic = design.substrate == 'elastic'
        self._moved = np.eye(1, design.N, design.N - 1)[0] if elastic else specimen.strain_shape

    def entry(self, shake: float) -> _Entry:
        """Enter the present state, under an acceleration of the base."""
        chain, design, cell = self._chain, self._chain.design, self._cell
        energy, force, squares, stuck, momentum, pull = _look(
            np.array(chain.v),
            np.array(chain.velocity),
            np.array(chain.V),
            np.array(chain.substrate_velocity),
            self._height,
            self._offsets,
            self._springs,
            self._masses,
            self._moving,
            np.array(self._moved),
            chain.specimen.eta,
            design.a,
            design.b,
            design.c,
            cell,
        )
        mass, speed = float(self._masses[cell]), float(chain.velocity[cell])
        return _Entry(
            energy,
            force,
            chain.specimen.eta * squares,
            stuck,
            -shake * momentum,
            pull + mass * shake,
            float(chain.v[cell]),
            0.5 * mass * speed * speed,
            chain.V_N,
        )


@kernel
def _look(
    v: Array,
    w: Array,
    V: Array,
    W: Array,
    height: Array,
    offsets: Array,
    s: Array,
    masses: Array,
    moving: Array,
    moved: Array,
    eta: float,
    a: float,
    b: float,
    c: float,
    cell: int,
) -> tuple[float, float, float, float, float, float]:
    """Return energy, force on V_N, squares of the speeds, power on stuck cells, momentum, pull."""
    n = len(v)
    energy = force = squares = stuck = momentum = pull = 0.0
    for j in range(n):
        y = v[j] - V[j] - offsets[j] + c
        phase = a * y + b * y * y * y
        slope = height[j] * (a + 3.0 * b * y * y) * math.sin(phase)
        energy += height[j] * (1.0 - math.cos(phase))
        energy += 0.5 * masses[j] * w[j] * w[j] + 0.5 * W[j] * W[j]
        on_cell, on_substrate = slope, -slope  # dU/dv_j and dU/dV_j
        if j > 0:
            on_cell += v[j] - v[j - 1]
            on_substrate += s[j - 1] * (V[j] - V[j - 1])
        if j < n - 1:
            stretch, tension = v[j + 1] - v[j], s[j] * (V[j + 1] - V[j])
            energy += 0.5 * stretch * stretch + 0.5 * tension * (V[j + 1] - V[j])
            on_cell -= stretch
            on_substrate -= tension
        on_cell += eta * w[j]
        force += moved[j] * on_substrate
        squares += w[j] * w[j] + W[j] * W[j]
        momentum += masses[j] * w[j] + W[j]
        if not moving[j]:
            stuck += on_cell * w[j]
        if j == cell:
            pull = on_cell
    return energy, force, squares, stuck, momentum, pull
