# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Five kicks write a byte, and one pulse hears it.

The start and the kicks are as in 7, but to and fro: v_1 to D_s2, to D_s1, ... five times, at mean
speeds of 0.26, 0.08, 0.035, 0.011 and 0.004; after each it is held for 20, and free for 1000.
*wall 0* ... *wall 7*, 6000 later: where the configuration passes the barrier, linear between
sites. Then a pulse as in 5, of 0.01, sigma 16 and frequency 1.7, for t up to 192. *echo*: the root
mean square of v_1 - place during the 900 after it.
"""

import numpy as np

from mlmem_ros.physics import CASE_II, Chain, HeldCell, Integrator, substep_times

from .problem import Answers, Problem

SPEEDS = (0.26, 0.08, 0.035, 0.011, 0.004)
LEVELS = (0, 1, 2, 5, 7)
HOLD, FREE, REST = 20.0, 1_000.0, 6_000.0
AMPLITUDE, SIGMA, CARRIER, LISTEN = 0.01, 16.0, 1.7, 900.0
T0 = 6.0 * SIGMA


def solve(integrator: Integrator, dt: float) -> Answers:
    """Return where the walls rest, and how loud they answer."""
    chain, wells = Chain(CASE_II, dt, integrator), (CASE_II.D_s1, CASE_II.D_s2)
    for number, speed in enumerate(SPEEDS):
        home, goal = wells[number % 2], wells[1 - number % 2]
        moving = abs(goal - home) / speed
        t = substep_times(round((moving + HOLD) / dt), dt, integrator)
        x = np.minimum(t / moving, 1.0)
        place = home + (goal - home) * x * x * (3.0 - 2.0 * x)
        velocity = (goal - home) * 6.0 * x * (1.0 - x) / moving
        chain.advance(np.zeros(len(t)), HeldCell(1, np.stack((place, velocity))))
        chain.rest(round(FREE / dt))
    chain.rest(round(REST / dt))
    over = chain.configuration - CASE_II.D_barrier
    sites = np.flatnonzero(over[:-1] * over[1:] < 0.0)
    places = sites + 1 + over[sites] / (over[sites] - over[sites + 1])
    home, held, steps = chain.end(1), round(2.0 * T0 / dt), round(LISTEN / dt)
    t = substep_times(held, dt, integrator)
    envelope = AMPLITUDE * np.exp(-0.5 * ((t - T0) / SIGMA) ** 2)
    sine, cosine = np.sin(CARRIER * t), CARRIER * np.cos(CARRIER * t)
    motion = np.array([home + envelope * sine, envelope * (cosine - (t - T0) / SIGMA**2 * sine)])
    heard = chain.advance(np.zeros(integrator.substeps * (held + steps)), HeldCell(1, motion))[0]
    echo = float(np.sqrt(np.mean(np.square(heard[held:] - home))))
    found = dict(zip(LEVELS, places.tolist(), strict=True))
    return {**{f'wall {level}': place for level, place in found.items()}, 'echo': echo}


PROBLEM = Problem('byte', 0.025, solve)
