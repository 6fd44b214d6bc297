# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Fronts of chains of other laws than a memory's."""

import numpy as np

from mlmem.physics import Integrator

from ..lattices import Coupling, Lattice, Linear, Phi4, PowerLaw, Toda
from .problem import Answers, crossing_site, define_problem, passage_time


@define_problem('kink', 0.05)
def kink(integrator: Integrator, dt: float) -> Answers:
    """A phi-4 kink under damping and a tilt.

    300 cells, springs of stiffness 1, on-site energy 0.02 (1 - u^2)^2 - 0.004 u, damping force
    0.05 u'. X = 50, 1/w = sqrt(0.04), wells -1 and 1. *speed*: 100 over the time that the front at
    u = 0 takes from 150 to 250.
    """
    height, first, last = 0.02, 150, 250
    chain = Lattice(
        Phi4(height, 0.004), Linear(), np.ones(300), dt, damping=0.05, integrator=integrator
    )
    chain.place(-np.tanh((np.arange(1.0, 301.0) - 50.0) * np.sqrt(2.0 * height)))
    time = passage_time(chain, 0.0, first, last, max(1, round(1.0 / dt)), 20_000)
    return {'speed': (last - first) / time}


COUPLINGS_BY_NAME: dict[str, Coupling] = {
    'linear': Linear(),
    'toda': Toda(1.0, 0.5),
    'power law': PowerLaw(4.0**4 / 3.0, -3.0, 4.0),
}
"""Those of the speed law."""


@define_problem('speed law', 0.02)
def speed_law(integrator: Integrator, dt: float) -> Answers:
    """The speed law E = gain v / (2 gamma) for three couplings (Nadkarni et al. 2016).

    300 cells, on-site energy 0.05 (1 - u^2)^2 - 0.02 u, damping force 0.1 u'. X = 40, 1/w =
    sqrt(0.1), wells those of the tilted energy; gain is their difference. Couplings: *linear*,
    stiffness 1; *toda*, energy (exp(-e/2) + e/2 - 1) / 0.25; *power law*, neighbours at distance 4
    repel with (256/3) r^-3 (stiffness 1 at rest). *speed* as in 1; *kinetic energy*, its mean
    meanwhile, sampled every 0.1; *over the law*, that over gain v / (2 gamma). The exact value
    is 1.
    """
    answers: Answers = {}
    height, tilt, damping, first, last = 0.05, 0.02, 0.1, 150, 250
    well = Phi4(height, tilt)
    wells = np.sort(np.roots([4.0 * height, 0.0, -4.0 * height, -tilt]).real)
    low, high = wells[0], wells[-1]
    gain = float(well.energy(low) - well.energy(high))
    j = np.arange(1.0, 301.0)
    for name, coupling in COUPLINGS_BY_NAME.items():
        chain = Lattice(well, coupling, np.ones(300), dt, damping=damping, integrator=integrator)
        chain.place(low + 0.5 * (high - low) * (1.0 - np.tanh((j - 40.0) * np.sqrt(2 * height))))
        times: list[float] = []
        places: list[float] = []
        energies: list[float] = []
        while len(times) < 20_000 and not (places and places[-1] >= last):
            chain.advance(max(1, round(0.1 / dt)))
            times.append(chain.time)
            places.append(crossing_site(chain.displacement, 0.0))
            energies.append(0.5 * float((chain.velocity**2).sum()))
        begin, end = np.interp((first, last), places, times)
        inside = (np.array(times) >= begin) & (np.array(times) <= end)
        speed = (last - first) / (end - begin)
        kinetic = float(np.array(energies)[inside].mean())
        answers[f'{name}: speed'] = float(speed)
        answers[f'{name}: kinetic energy'] = kinetic
        answers[f'{name}: over the law'] = float(kinetic / (gain * speed / (2.0 * damping)))
    return answers
