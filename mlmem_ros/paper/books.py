# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The books of a chain's energy: what goes into it is stored there or becomes heat.

They are kept from the Lagrangian alone, not from the accelerations of the loops.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..physics import Chain, Drive
from ..physics.energy import end_force, kinetic, moving_masses
from ..physics.potential import Array
from ..physics.statics import energies, metamaterial_force


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
    states, end, ends = np.empty((steps + 1, 4, chain.design.N)), [chain.V_N], np.empty((2, steps))
    states[0] = chain.v, chain.velocity, chain.V, chain.substrate_velocity
    for k in range(steps):
        now = slice(substeps * k, substeps * (k + 1))
        part = None
        if drive is not None and drive.motion[:, now].size:
            part = Drive(drive.site, drive.motion[:, now])
        ends[:, k : k + 1] = advance(V_N[now], part, shake[now])
        states[k + 1] = chain.v, chain.velocity, chain.V, chain.substrate_velocity
        end.append(chain.V_N)
    base = np.concatenate((shake[:1], shake[substeps - 1 :: substeps]))
    return ends, _budget(chain, np.moveaxis(states, 1, 0), np.array(end), drive, base)


def _budget(chain: Chain, states: Array, V_N: Array, drive: Drive | None, base: Array) -> Budget:
    """Return the budget of m moments: v, velocity, V and its velocity, shape (4, m, N)."""
    (v, w, V, W), made, dt = states, chain.specimen, chain.dt
    masses = moving_masses(made)
    stored = kinetic(made, w, W) + np.sum(energies(made, v, V), axis=0)
    momentum = w @ masses + W.sum(axis=1)
    held = 0.0
    if drive is not None:
        last = -(-drive.motion.shape[1] // chain.integrator.substeps)
        j, driven = drive.site - 1, slice(0, last + 1)
        speed = w[driven, j]
        pull = -metamaterial_force(made, v[driven], V[driven])[:, j]
        pull += made.eta * speed + masses[j] * base[driven]
        held = float(_between(pull) @ np.diff(v[driven, j]))
        held += 0.5 * float(masses[j] * (speed[-1] ** 2 - speed[0] ** 2))
    return Budget(
        gained=float(stored[-1] - stored[0]),
        damped=dt * _between(made.eta * (w**2 + W**2)).sum(axis=0),
        actuator=float(_between(end_force(made, v, V)) @ np.diff(V_N)),
        held=held,
        shake=-dt * float(_between(base * momentum).sum()),
        stored=float(stored[-1]),
    )


def _between(moments: Array) -> Array:
    """Return the means of consecutive moments."""
    return np.asarray(0.5 * (moments[:-1] + moments[1:]))
