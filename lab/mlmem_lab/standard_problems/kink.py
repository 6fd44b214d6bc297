# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A phi-4 kink under damping and a tilt.

300 cells, springs of stiffness 1, on-site energy 0.02 (1 - u^2)^2 - 0.004 u, damping force 0.05
u'. X = 50, 1/w = sqrt(0.04), wells -1 and 1. *speed*: 100 over the time that the front at u = 0
takes from 150 to 250.
"""

import numpy as np

from mlmem_ros.physics import Integrator

from ..lattices import Lattice, Linear, Phi4
from .problem import Answers, Problem, passage

N, HEIGHT, TILT, DAMPING = 300, 0.02, 0.004, 0.05
START, FROM, TO = 50.0, 150, 250


def solve(integrator: Integrator, dt: float) -> Answers:
    """Return the kink's steady speed, sites per unit of time."""
    chain = Lattice(
        Phi4(HEIGHT, TILT), Linear(), np.ones(N), dt, damping=DAMPING, integrator=integrator
    )
    j = np.arange(1.0, N + 1.0)
    chain.place(-np.tanh((j - START) * np.sqrt(2.0 * HEIGHT)))
    time = passage(chain, 0.0, FROM, TO, max(1, round(1.0 / dt)), 20_000)
    return {'speed': (TO - FROM) / time}


PROBLEM = Problem('kink', 0.05, solve)
