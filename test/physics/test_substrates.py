# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Over a rigid and over an elastic substrate every step of strain writes its level.

The ramps are the published lead, 1200 up, 600 hold, 1200 down, 1500 to settle.
"""

import dataclasses

import numpy as np
import oracle
import pytest
from sampled import sampled

from mlmem.physics import (
    CASE_II,
    NOH_BATHE,
    Chain,
    Specimen,
    find_walls,
    stable_step,
    substep_times,
)
from mlmem.physics.equilibrium import find_pinned_wall


def cycle(chain, peak):
    """Strain the element to a peak and back; return the wall's path, every 25 time units."""
    sample = round(25.0 / chain.dt)
    t = substep_times(180 * sample, chain.dt, NOH_BATHE)
    strain = peak * (oracle.smooth(t / 1200.0) - oracle.smooth((t - 1800.0) / 1200.0))
    path = []
    for V_N in np.split(chain.design.end_displacement(strain), 180):
        chain.advance(V_N)
        (wall,) = find_walls(chain.design, chain.configuration)
        path.append(wall.position)
    return np.array(path)


def element(substrate, N=225):
    """Return a chain at level 0; both step sizes fit 25 time units a whole number of times."""
    design = dataclasses.replace(CASE_II, N=N, substrate=substrate)
    whole = np.ceil(25.0 / min(0.25, stable_step(Specimen(design), NOH_BATHE)))
    chain = Chain(design, 25.0 / whole, NOH_BATHE)
    chain.place(find_pinned_wall(Specimen(design), 0))
    return chain


@pytest.mark.parametrize('substrate', ['rigid', 'elastic'])
@pytest.mark.parametrize('levels', sampled([3, 8], lambda levels: levels == 3))
def test_every_step_writes_its_level(substrate, levels):
    chain = element(substrate, N=25 * (levels + 1))
    for level in range(1, levels):
        path = cycle(chain, -0.030 if level % 2 else 0.045)
        assert path[-1] == pytest.approx(chain.design.defect_site(level), abs=0.6)
        assert abs(chain.V_N) < 1e-9
