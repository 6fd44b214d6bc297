# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""3: the measured lattice, nine cases, with losses as stated on the page."""

from mlmem_ros.physics import Integrator

from ..measured.runs import CASES
from ..measured.shell import MEASURED
from ..measured.wave import Losses, launch
from .problem import Answers, Problem

LOSSES = Losses(damping=0.0186, friction=0.0146)


def solve(integrator: Integrator, dt: float) -> Answers:
    """Return the speeds over elements 8 to 11, m/s."""
    return {
        str(case): launch(case, MEASURED[case.rail], LOSSES, integrator=integrator, dt=dt).speed
        for case in CASES
    }


PROBLEM = Problem('real lattice', 0.05, solve)
