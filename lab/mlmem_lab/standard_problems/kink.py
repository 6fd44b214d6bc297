# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""1: a phi-4 kink under damping and a tilt."""

import numpy as np

from mlmem_ros.physics import Integrator
from mlmem_ros.physics.laws import Linear

from ..lattices import Lattice, Phi4
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
