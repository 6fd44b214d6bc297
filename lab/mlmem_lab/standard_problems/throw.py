# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A wall leaves the element, because a strain is let go.

The design `bits_4`, rigid substrate. X = 81, w = 4, 4000 of rest. Strain to 0.135 in 400, held 20,
to -0.0135 in 70, to 0 in 240, each along 3 x^2 - 2 x^3. *place when let go*; *time to cell 9* from
then; *active cells at the end*, 1000 later.
"""

import numpy as np

from mlmem_ros.device.presets import preset
from mlmem_ros.physics import Chain, Integrator, substep_times
from mlmem_ros.physics.potential import Array

from .problem import Answers, Problem, crossing

SITE, WIDTH, SETTLE = 81.0, 4.0, 4_000.0
PEAK, RAMP, HOLD, EASE, BACK = 0.135, 400.0, 20.0, 70.0, 240.0
UNDERSHOOT = -0.1
REST = 1_000.0


def strain(t: Array) -> Array:
    """Return the strain at times from the start of the ramp."""
    ends = np.cumsum([0.0, RAMP, HOLD, EASE, BACK])
    values = [0.0, PEAK, PEAK, UNDERSHOOT * PEAK, 0.0]
    part = np.clip(np.searchsorted(ends, t, 'right') - 1, 0, 3)
    x = np.clip((t - ends[part]) / np.diff(ends)[part], 0.0, 1.0)
    change = np.diff(values)[part]
    return np.asarray(np.array(values)[part] + change * x * x * (3.0 - 2.0 * x))


def solve(integrator: Integrator, dt: float) -> Answers:
    """Return where the wall is when the strain is let go, and when it passes cell 9."""
    design, _ = preset('bits_4')
    chain = Chain(design, dt, integrator)
    middle, half = 0.5 * (design.D_s1 + design.D_s2), 0.5 * (design.D_s2 - design.D_s1)
    chain.place(middle - half * np.tanh((design.sites - SITE) / WIDTH))
    chain.rest(round(SETTLE / dt))
    every, times, places = round(1.0 / dt), [], []
    for k in range(round(RAMP + HOLD + EASE + BACK + REST)):
        t = substep_times(every, dt, integrator, k * every)
        chain.advance(design.end_displacement(1.0) * strain(t))
        times.append(k + 1.0)
        places.append(crossing(chain.configuration, design.D_barrier))
    let_go = round(RAMP + HOLD)
    track = np.nan_to_num(np.array(places[let_go:]))
    gone = int(np.argmax(track < 9.0))
    share = (track[gone - 1] - 9.0) / (track[gone - 1] - track[gone])
    return {
        'place when let go': places[let_go - 1],
        'time to cell 9': gone + float(share),
        'active cells at the end': float((chain.configuration > design.D_barrier).sum()),
    }


PROBLEM = Problem('throw', 0.05, solve)
