# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Nine measured lattices.

The chain and shells of `lab/mlmem_lab/measured/data/README.md`, 26th element held. The first is
moved along 3 x^2 - 2 x^3 to its second well in 25 ms and held. Damping 0.0186 per ms, dry friction
0.0146 (10 N) times v / sqrt(v^2 + 0.002^2). Magnets closer than 0.3 cm push as at 0.3 cm. *21.5/6*
etc.: three spacings over the time between half-way points of elements 8 and 11, in m/s;
displacements every 2 ms, linear in between. Steps are in ms. Where no wave was measured, equal
elements still propagate one.
"""

from mlmem_ros.physics import Integrator

from ..measured.runs import CASES
from ..measured.wave import MEASURED, Losses, launch
from .problem import Answers, Problem

LOSSES = Losses(damping=0.0186, friction=0.0146)


def solve(integrator: Integrator, dt: float) -> Answers:
    """Return the speeds over elements 8 to 11, m/s."""
    return {
        str(case): launch(case, MEASURED[case.rail], LOSSES, integrator=integrator, dt=dt).speed
        for case in CASES
    }


PROBLEM = Problem('real lattice', 0.05, solve)
