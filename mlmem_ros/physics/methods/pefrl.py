# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""PEFRL, a symplectic integrator of fourth order: five drifts and, between them, four kicks.

Omelyan, Mryglod and Folk, Comput. Phys. Commun. 146 (2002) 188, Eqs. (20) and (22): the
position-extended Forest-Ruth-like scheme. A drift moves the displacements at fixed velocities. A
kick solves m v' = f - eta v exactly at fixed displacements, so that the damping, too, costs no
order. Time goes with the drifts: what is prescribed is taken at the stages' own times.

Undamped it loses no energy in the long run, and small waves keep their amplitude: what damping
an echo has met is the material's alone.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..jit import inlined, kernel
from ..portable import exponential
from ..potential import Array, on_site
from .arrays import Cells, Chained, Course, aligned, displacements, per_cell
from .integrator import Complex, Integrator

XI, LAMBDA, CHI = 0.1786178958448091, -0.2123418310626054, -0.06626458266981849

DRIFTS = (XI, CHI, 1.0 - 2.0 * (CHI + XI), CHI, XI)
"""Shares of the step."""

KICKS = (0.5 - LAMBDA, LAMBDA, LAMBDA, 0.5 - LAMBDA)
"""Shares of the step, between the drifts."""

OMEGA_DT_LIMIT = 2.98
"""Largest omega dt we call stable: undamped it is 2.9895, and damping only adds to it."""


class Kick(NamedTuple):
    """What a kick makes of a velocity v, a force f and an acceleration A of the base.

    v' = decay v + kick f - push A, by cell, shape (N,); likewise for a substrate cell, of mass 1,
    whose kick and push are the same.
    """

    decay: Array
    kick: Array
    push: Array
    substrate_decay: float
    substrate_kick: float


@inlined
def stage(
    x: Array, new: Array, v: Array, X: Array, NEW: Array, V: Array, substrate: Chained | None,
    cells: Cells, by: Kick, drift: float, V_N: float, base: float,
) -> None:  # fmt: skip
    """Kick at the displacements x, then drift to the new ones."""
    height, offset, _, under, stuck, _, a, b, c = cells
    decay, kick, push, substrate_decay, substrate_kick = by
    n = len(v)
    x[0] = x[1]
    x[n + 1] = x[n]
    if substrate is not None:
        X[1] = 0.0
        X[n] = V_N
    for j in range(n):
        at = x[j + 1]
        AT = V_N * under[j] if substrate is None else X[j + 1]
        force = on_site(height[j], at - (AT + offset[j]), a, b, c)
        pull = (x[j] - 2.0 * at) + x[j + 2] - force
        velocity = decay[j] * v[j] + kick[j] * pull - push[j] * base
        v[j] = velocity
        new[j + 1] = at + drift * velocity
        if substrate is not None:
            spring = under[j + 1] * (X[j + 2] - AT) - under[j] * (AT - X[j])
            velocity = substrate_decay * V[j] + substrate_kick * (spring + force - base)
            V[j] = velocity
            NEW[j + 1] = AT + drift * velocity
    for j in stuck:
        new[j + 1] = x[j + 1]
        v[j] = 0.0


@kernel
def advance(
    steps: int,
    chain: Chained,
    substrate: Chained | None,
    cells: Cells,
    course: Course,
    constants: tuple[float, float, float, Kick, Kick],
    ends: Array,
) -> None:
    """Advance Eq. (1a), and over an elastic substrate Eq. (1b); see `noh_bathe.advance`.

    Args:
        steps: Number of steps.
        chain: u, v, A, which this method has no use for, and the work space x, y.
        substrate: The same of an elastic substrate, or None.
        cells: The element.
        course: What is prescribed, in the order of time, in which the stages are not: the second
            goes back. A step that is not driven to its end is free.
        constants: Lengths in time of the first three drifts, the outer and the inner kicks.
        ends: Out: displacement of the first and the last cell after every step, (2, steps).
    """
    u, v, _, x, y = chain
    U, V, _, X, Y = chain if substrate is None else substrate
    V_N, shake, site, driven, motion = course
    d0, d1, d2, outer, inner = constants
    n = len(v)

    for k in range(steps):
        i = 5 * k
        held = i + 5 <= driven
        for j in range(n):
            x[j + 1] = u[j + 1] + d0 * v[j]
            if substrate is not None:
                X[j + 1] = U[j + 1] + d0 * V[j]
        if held:
            x[site] = motion[0, i + 1]
        stage(x, y, v, X, Y, V, substrate, cells, outer, d1, V_N[i + 1], shake[i + 1])
        if held:
            y[site] = motion[0, i]
        stage(y, x, v, Y, X, V, substrate, cells, inner, d2, V_N[i], shake[i])
        if held:
            x[site] = motion[0, i + 3]
        stage(x, y, v, X, Y, V, substrate, cells, inner, d1, V_N[i + 3], shake[i + 3])
        if held:
            y[site] = motion[0, i + 2]
        stage(y, u, v, Y, U, V, substrate, cells, outer, d0, V_N[i + 2], shake[i + 2])
        if substrate is not None:
            U[1] = 0.0
            U[n] = V_N[i + 4]
            V[0] = V[n - 1] = 0.0
        if held:
            u[site] = motion[0, i + 4]
            v[site - 1] = motion[1, i + 4]
        ends[0, k] = u[1]
        ends[1, k] = u[n]


class Pefrl(Integrator):
    """The method as a chain takes it."""

    name = 'pefrl'
    nodes = (XI + CHI, XI, 1.0 - XI, 1.0 - XI - CHI, 1.0)
    accurate_step = 0.5  # 6 steps per period of the probe's carrier
    accurate_turn = 1.2
    keeps_accelerations = False
    advance = staticmethod(advance)

    def limit(self, omega: float, eta: float) -> float:
        """Return the largest stable step (see `Integrator`)."""
        return OMEGA_DT_LIMIT / omega

    def arrays(self, n: int) -> Chained:
        """Return u, v, A and the loop's two arrays of work space (see `Integrator`)."""
        x, y = displacements(n), displacements(n)
        return displacements(n), per_cell(n), per_cell(n), x, y

    def constants(
        self, dt: float, mobility: Array, eta: float
    ) -> tuple[float, float, float, Kick, Kick]:
        """Return drifts and kicks (see `Integrator`)."""
        d0, d1, d2 = (share * dt for share in DRIFTS[:3])
        outer, inner = (_kick_of_cells(share * dt, mobility, eta) for share in KICKS[:2])
        return d0, d1, d2, outer, inner

    def step_matrix(self, stiffness: Complex, eta: float, dt: float) -> Complex:
        """Return the matrix of a step on (U, V), shape (m, 2, 2) (see `Integrator`)."""
        U, V = np.eye(2, dtype=np.complex128)[:, None, :] * np.ones((len(stiffness), 1))
        for number, share in enumerate(DRIFTS):
            U = U + share * dt * V
            if number < len(KICKS):
                decay, kick, _ = _kick(KICKS[number] * dt, np.ones(1), eta)
                V = decay * V - kick * stiffness[:, None] * U
        return np.stack((U, V), axis=1)


def _kick_of_cells(h: float, mobility: Array, eta: float) -> Kick:
    """Return a kick of a length in time of cells of any mass, and of the substrate's."""
    decay, kick, push = (aligned(each) for each in _kick(h, mobility, eta))
    substrate_decay, substrate_kick, _ = (float(each[0]) for each in _kick(h, np.ones(1), eta))
    return Kick(decay, kick, push, substrate_decay, substrate_kick)


def _kick(h: float, mobility: Array, eta: float) -> tuple[Array, Array, Array]:
    """Return what a kick of a length in time makes of velocity, force and base acceleration.

    v' = decay v + kick f - push A with decay = exp(-z), push = h (1 - exp(-z)) / z and
    kick = push / m, where z = eta h / m; the fraction by its series where z is small.
    """
    z = eta * h * mobility
    decay = exponential(-z)
    series = np.ones_like(z)
    for order in range(12, 0, -1):
        series = 1.0 - z * series / (order + 1.0)
    large = np.abs(z) > 0.1
    share = np.where(large, (1.0 - decay) / np.where(large, z, 1.0), series)
    push = h * share
    return decay, push * mobility, push


PEFRL = Pefrl()
"""The method of fourth order."""
