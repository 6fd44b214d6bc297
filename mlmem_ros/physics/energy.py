# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The books of a chain's energy: what goes into it is stored there or becomes heat.

They are kept from the Lagrangian alone, not from the accelerations of the loops.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .chain import Chain, Drive
from .potential import Array
from .statics import energies, metamaterial_force, substrate_force

NEGLIGIBLE = 1e-9
"""Share of the stored energy below which an exchange is rounding and no measure."""


@dataclass(frozen=True)
class Energy:
    """Where the energy of a chain is, in k_r (lattice constant)^2.

    Attributes:
        kinetic: Of all masses; the quasi-static substrate of the rigid model has none.
        coupling: In the springs between metamaterial cells.
        on_site: In the multi-stable springs.
        substrate: In the substrate's springs.
    """

    kinetic: float
    coupling: float
    on_site: float
    substrate: float

    @property
    def total(self) -> float:
        """The sum of all parts."""
        return self.kinetic + self.coupling + self.on_site + self.substrate


@dataclass(frozen=True)
class Budget:
    """Where the energy of a run came from and went to, in k_r (lattice constant)^2.

    Attributes:
        gained: Change of the stored energy.
        damped: What the damping took of every cell, with the substrate under it, shape (N,).
        actuator: Work on the substrate's end.
        held: Work on the driven cell, against springs, damping and inertia.
        shake: Work of the base's acceleration.
        stored: Energy of both chains at the end.
    """

    gained: float
    damped: Array
    actuator: float
    held: float
    shake: float
    stored: float

    @property
    def heat(self) -> float:
        """What the damping took of all cells."""
        return float(np.sum(self.damped))

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


def energy(chain: Chain) -> Energy:
    """Return the energy of a chain's present state."""
    now = _Moments(chain, 1)
    now.note(0)
    return Energy(*(float(part[0]) for part in now.energies()))


def actuator_force(chain: Chain) -> float:
    """Return the force that holds the substrate's end at V_N, tension positive.

    It is dU/dV_N: of the whole quasi-static foundation with the rigid substrate, of the end
    site with the elastic one.
    """
    now = _Moments(chain, 1)
    now.note(0)
    return float(now.actuator_force()[0])


def damping_power(chain: Chain) -> float:
    """Return the power that the on-site damping dissipates, eta times the squared speeds."""
    now = _Moments(chain, 1)
    now.note(0)
    return float(now.damping().sum())


def audit(
    chain: Chain,
    V_N: Array,
    drive: Drive | None = None,
    shake: Array | None = None,
    *,
    most: int | None = None,
) -> Budget:
    """Advance a chain, step by step, and keep books.

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
    until = None if most is None else most * chain.integrator.substeps
    base = np.zeros_like(V_N) if shake is None else shake
    return audited(chain, chain.advance, V_N[:until], drive, base[:until])[1]


def audited(
    chain: Chain,
    advance: Callable[[Array, Drive | None, Array], Array],
    V_N: Array,
    drive: Drive | None,
    shake: Array,
) -> tuple[Array, Budget]:
    """Advance a chain by single steps of a function; return what it returned, and a budget.

    Powers are integrated by the trapezoidal rule over the steps, of second order.

    Args:
        chain: The chain.
        advance: `Chain.advance` of it.
        V_N: Displacement of the substrate's end, checked.
        drive: A cell held at a prescribed motion, checked.
        shake: Acceleration of the base, checked.
    """
    substeps = chain.integrator.substeps
    steps = len(V_N) // substeps
    moments, ends = _Moments(chain, steps + 1), np.empty((2, steps))
    moments.note(0)
    for k in range(steps):
        now = slice(substeps * k, substeps * (k + 1))
        part = None
        if drive is not None and drive.motion[:, now].size:
            part = Drive(drive.site, drive.motion[:, now])
        ends[:, k : k + 1] = advance(V_N[now], part, shake[now])
        moments.note(k + 1)
    base = np.concatenate((shake[:1], shake[substeps - 1 :: substeps]))
    return ends, moments.budget(drive, base)


class _Moments:
    """A chain at consecutive moments: rows of shape (m, N)."""

    def __init__(self, chain: Chain, m: int) -> None:
        self._chain, self._made = chain, chain.specimen
        self._v, self._w, self._V, self._W = np.empty((4, m, chain.design.N))
        self._V_N = np.empty(m)
        moves = np.isfinite(self._made.masses)  # a stuck cell does not
        self._masses = np.where(moves, self._made.masses, 0.0)

    def note(self, k: int) -> None:
        """Keep the present state as the k-th moment."""
        chain = self._chain
        self._v[k], self._w[k], self._V_N[k] = chain.v, chain.velocity, chain.V_N
        self._V[k], self._W[k] = chain.V, chain.substrate_velocity

    def energies(self) -> tuple[Array, Array, Array, Array]:
        """Return the kinetic energy and those of `statics`, shape (m,) each."""
        motion = np.sum(self._masses * self._w**2, axis=1) + np.sum(self._W**2, axis=1)
        return (np.asarray(0.5 * motion), *energies(self._made, self._v, self._V))

    def actuator_force(self) -> Array:
        """Return the force on the substrate's end, shape (m,)."""
        force = -substrate_force(self._made, self._v, self._V)
        if self._chain.design.substrate == 'elastic':
            return np.asarray(force[:, -1])
        return np.asarray(force @ self._made.strain_shape)

    def damping(self) -> Array:
        """Return the power that the damping takes of every cell, shape (m, N)."""
        return np.asarray(self._made.eta * (self._w**2 + self._W**2))

    def budget(self, drive: Drive | None, base: Array) -> Budget:
        """Return the budget from the first moment to the last."""
        stored = np.sum(self.energies(), axis=0)
        momentum = self._w @ self._masses + self._W.sum(axis=1)
        held = 0.0
        if drive is not None:
            last = -(-drive.motion.shape[1] // self._chain.integrator.substeps)
            j, driven = drive.site - 1, slice(0, last + 1)
            mass, speed = self._masses[j], self._w[driven, j]
            pull = -metamaterial_force(self._made, self._v[driven], self._V[driven])[:, j]
            pull += self._made.eta * speed + mass * base[driven]
            held = float(_between(pull) @ np.diff(self._v[driven, j]))
            held += 0.5 * float(mass * (speed[-1] ** 2 - speed[0] ** 2))
        dt = self._chain.dt
        return Budget(
            gained=float(stored[-1] - stored[0]),
            damped=dt * _between(self.damping()).sum(axis=0),
            actuator=float(_between(self.actuator_force()) @ np.diff(self._V_N)),
            held=held,
            shake=-dt * float(_between(base * momentum).sum()),
            stored=float(stored[-1]),
        )


def _between(moments: Array) -> Array:
    """Return the means of consecutive moments."""
    return np.asarray(0.5 * (moments[:-1] + moments[1:]))
