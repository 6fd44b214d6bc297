# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A soft defect stops a wall.

The paper's Case I (Table I), no strain. X = 50, w = 8. *farthest* place of the wall in 12 000,
looked at once per unit of time, and where it comes to *rest*.
"""

import numpy as np

from mlmem_ros.physics import CASE_I, Chain, Integrator

from .problem import Answers, Problem, crossing

START, WIDTH, DURATION, LOOK = 50.0, 8.0, 12_000.0, 1.0


def solve(integrator: Integrator, dt: float) -> Answers:
    """Return how far the wall goes at most, and where it comes to rest."""
    design = CASE_I
    chain = Chain(design, dt, integrator)
    middle, half = 0.5 * (design.D_s1 + design.D_s2), 0.5 * (design.D_s2 - design.D_s1)
    chain.place(middle - half * np.tanh((design.sites - START) / WIDTH))
    every = round(LOOK / dt)
    places = []
    for _ in range(round(DURATION / LOOK)):
        chain.rest(every)
        places.append(crossing(chain.v, design.D_barrier))
    return {'farthest': max(places), 'rest': places[-1]}


PROBLEM = Problem('pinning', 0.1, solve)
