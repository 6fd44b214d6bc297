# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A wall is kicked from an end, without strain, and stops at a defect.

Case II with N = 225, rigid substrate, all cells inactive and at rest. v_1 goes from D_s1 to D_s2
along 3 x^2 - 2 x^3 in 2 / 0.08 = 25 units, held for 20, then free. *time to cell 60*; *place after
1000*, both from the start; *rest*, the place 10 000 later; *energy*, over that of the blank one,
when the end is let go.
"""

import numpy as np

from mlmem_ros.physics import CASE_II, Chain, HeldCell, Integrator, substep_times
from mlmem_ros.physics.energy import energy
from mlmem_ros.physics.potential import Array

from .problem import Answers, Problem, crossing

MOVING, HOLD, MARK = 25.0, 20.0, 60.0
LATER, REST = 1_000.0, 10_000.0


def motion(t: Array) -> Array:
    """Return displacement and velocity of the first cell, shape (2, m)."""
    x, way = np.minimum(t / MOVING, 1.0), CASE_II.D_s2 - CASE_II.D_s1
    rate = np.where(t < MOVING, 1.0 / MOVING, 0.0)
    return np.stack(
        (CASE_II.D_s1 + way * x * x * (3.0 - 2.0 * x), 6.0 * way * rate * x * (1.0 - x))
    )


def solve(integrator: Integrator, dt: float) -> Answers:
    """Return how the wall runs and where it stops."""
    chain = Chain(CASE_II, dt, integrator)
    before = energy(chain).total
    steps = round((MOVING + HOLD) / dt)
    times = substep_times(steps, dt, integrator)
    chain.advance(np.zeros(len(times)), HeldCell(1, motion(times)))
    put_in = energy(chain).total - before
    every, places = round(1.0 / dt), [crossing(chain.configuration, CASE_II.D_barrier)]
    for _ in range(round(LATER - MOVING - HOLD)):
        chain.rest(every)
        places.append(crossing(chain.configuration, CASE_II.D_barrier))
    later = places[-1]
    chain.rest(round(REST / dt))
    passed = int(np.argmax(np.nan_to_num(places) >= MARK))
    share = (MARK - places[passed - 1]) / (places[passed] - places[passed - 1])
    return {
        'energy': put_in,
        'time to cell 60': MOVING + HOLD + passed - 1 + float(share),
        'place after 1000': later,
        'rest': crossing(chain.configuration, CASE_II.D_barrier),
    }


PROBLEM = Problem('kick', 0.05, solve)
