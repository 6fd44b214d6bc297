# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An echo of a wall.

The paper's Case II. X = 100, w = 4, 6000 of rest. Then v_1 is held at its place plus 0.01 exp(-((t
- 48)/8)^2/2) sin(1.5 t), with the velocity of that, for t up to 96; free afterwards. |v_1 - place|
over 600 is averaged in a centred box of 16 pi / 1.5. *delay*: when it is largest after t = 144,
minus 48. *loudness*: that maximum.
"""

import math

import numpy as np

from mlmem_ros.physics import CASE_II, Chain, HeldCell, Integrator, substep_times

from .problem import Answers, Problem

SITE, WIDTH, SETTLE = 100.0, 4.0, 6_000.0
AMPLITUDE, SIGMA, CARRIER, LISTEN = 0.01, 8.0, 1.5, 600.0
T0 = 6.0 * SIGMA


def solve(integrator: Integrator, dt: float) -> Answers:
    """Return when the smoothed echo is loudest, after the middle of the pulse, and how loud."""
    design = CASE_II
    chain = Chain(design, dt, integrator)
    middle, half = 0.5 * (design.D_s1 + design.D_s2), 0.5 * (design.D_s2 - design.D_s1)
    chain.place(middle - half * np.tanh((design.sites - SITE) / WIDTH))
    chain.rest(round(SETTLE / dt))
    home, steps = chain.end(1), round(LISTEN / dt)
    t = substep_times(round(2.0 * T0 / dt), dt, integrator)
    envelope = AMPLITUDE * np.exp(-0.5 * ((t - T0) / SIGMA) ** 2)
    sine, cosine = np.sin(CARRIER * t), CARRIER * np.cos(CARRIER * t)
    motion = np.array([home + envelope * sine, envelope * (cosine - (t - T0) / SIGMA**2 * sine)])
    heard = chain.advance(np.zeros(integrator.substeps * steps), HeldCell(1, motion))[0]
    box = round(16.0 * math.pi / CARRIER / dt)
    smooth = np.convolve(np.abs(heard - home), np.full(box, 1.0 / box), 'same')
    late = round(3.0 * T0 / dt)
    loudest = late + int(np.argmax(smooth[late:]))
    return {'delay': (loudest + 1) * dt - T0, 'loudness': float(smooth[loudest])}


PROBLEM = Problem('echo', 0.05, solve)
