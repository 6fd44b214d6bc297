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

from typing import Any

import numpy as np

from .field import aligned
from .integrator import Complex, Integrator
from .pefrl_kernel import advance_elastic, advance_rigid
from .portable import exponential
from .potential import Array

XI, LAMBDA, CHI = 0.1786178958448091, -0.2123418310626054, -0.06626458266981849

DRIFTS = (XI, CHI, 1.0 - 2.0 * (CHI + XI), CHI, XI)
"""Shares of the step."""

KICKS = (0.5 - LAMBDA, LAMBDA, LAMBDA, 0.5 - LAMBDA)
"""Shares of the step, between the drifts."""

OMEGA_DT_LIMIT = 2.98
"""Largest omega dt we call stable: undamped it is 2.9895, and damping only adds to it."""


class Pefrl(Integrator):
    """The method as a chain takes it."""

    name = 'pefrl'
    nodes = (XI + CHI, XI, 1.0 - XI, 1.0 - XI - CHI, 1.0)
    accurate_step = 0.5  # 6 steps per period of the probe's carrier
    accurate_turn = 1.2
    keeps_accelerations = False
    rigid = staticmethod(advance_rigid)
    elastic = staticmethod(advance_elastic)

    def limit(self, omega: float, eta: float) -> float:
        """Return the largest stable step (see `Integrator`)."""
        return OMEGA_DT_LIMIT / omega

    def work(self, n: int) -> tuple[Array, ...]:
        """Return the loops' two arrays of work space, with ghost cells."""
        return aligned(np.zeros(n + 2), 1), aligned(np.zeros(n + 2), 1)

    def constants(self, dt: float, mobility: Array, eta: float) -> tuple[Any, ...]:
        """Return drifts, and the kicks of cells of any mass (see `Integrator`)."""
        kicks = [aligned(each) for share in KICKS[:2] for each in _kick(share * dt, mobility, eta)]
        return np.array(DRIFTS[:3]) * dt, *kicks

    def substrate_constants(self, dt: float, eta: float) -> tuple[Any, ...]:
        """Return the kicks of the substrate's cells, of mass 1 (see `Integrator`)."""
        kicks = [_kick(share * dt, np.ones(1), eta)[:2] for share in KICKS[:2]]
        return (np.array(kicks).ravel(),)

    def step_matrix(self, stiffness: Complex, eta: float, dt: float) -> Complex:
        """Return the matrix of a step on (U, V), shape (m, 2, 2) (see `Integrator`)."""
        U, V = np.eye(2, dtype=np.complex128)[:, None, :] * np.ones((len(stiffness), 1))
        for number, share in enumerate(DRIFTS):
            U = U + share * dt * V
            if number < len(KICKS):
                decay, kick, _ = _kick(KICKS[number] * dt, np.ones(1), eta)
                V = decay * V - kick * stiffness[:, None] * U
        return np.stack((U, V), axis=1)


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
