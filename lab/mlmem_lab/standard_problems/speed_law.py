# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The speed law E = gain v / (2 gamma) for three couplings (Nadkarni et al. 2016).

300 cells, on-site energy 0.05 (1 - u^2)^2 - 0.02 u, damping force 0.1 u'. X = 40, 1/w = sqrt(0.1),
wells those of the tilted energy; gain is their difference. Couplings: *linear*, stiffness 1;
*toda*, energy (exp(-e/2) + e/2 - 1) / 0.25; *power law*, neighbours at distance 4 repel with
(256/3) r^-3 (stiffness 1 at rest). *speed* as in 1; *kinetic energy*, its mean meanwhile, sampled
every 0.1; *over the law*, that over gain v / (2 gamma). The exact value is 1.
"""

import numpy as np

from mlmem_ros.physics import Integrator

from ..lattices import Coupling, Lattice, Linear, Phi4, PowerLaw, Toda
from .problem import Answers, Problem, crossing

N, HEIGHT, TILT, DAMPING = 300, 0.05, 0.02, 0.1
START, FROM, TO = 40.0, 150, 250
WELL = Phi4(HEIGHT, TILT)
COUPLINGS: dict[str, Coupling] = {
    'linear': Linear(),
    'toda': Toda(1.0, 0.5),
    'power law': PowerLaw(4.0**4 / 3.0, -3.0, 4.0),
}


def solve(integrator: Integrator, dt: float) -> Answers:
    """Return speed v and mean kinetic energy E, and E over what the law says, per coupling."""
    answers: Answers = {}
    wells = np.sort(np.roots([4.0 * HEIGHT, 0.0, -4.0 * HEIGHT, -TILT]).real)
    gain = float(WELL.energy(wells[0]) - WELL.energy(wells[-1]))
    for name, coupling in COUPLINGS.items():
        chain = Lattice(WELL, coupling, np.ones(N), dt, damping=DAMPING, integrator=integrator)
        j = np.arange(1.0, N + 1.0)
        low, high = wells[0], wells[-1]
        chain.place(low + 0.5 * (high - low) * (1.0 - np.tanh((j - START) * np.sqrt(2 * HEIGHT))))
        times: list[float] = []
        places: list[float] = []
        energies: list[float] = []
        while len(times) < 20_000 and not (places and places[-1] >= TO):
            chain.advance(max(1, round(0.1 / dt)))
            times.append(chain.time)
            places.append(crossing(chain.displacement, 0.0))
            energies.append(0.5 * float((chain.velocity**2).sum()))
        begin, end = np.interp((FROM, TO), places, times)
        inside = (np.array(times) >= begin) & (np.array(times) <= end)
        speed = (TO - FROM) / (end - begin)
        kinetic = float(np.array(energies)[inside].mean())
        answers[f'{name}: speed'] = float(speed)
        answers[f'{name}: kinetic energy'] = kinetic
        answers[f'{name}: over the law'] = float(kinetic / (gain * speed / (2.0 * DAMPING)))
    return answers


PROBLEM = Problem('speed law', 0.02, solve)
