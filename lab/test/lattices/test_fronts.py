# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Steady fronts against the universal law of energy transport (Nadkarni, Daraio, Abeyaratne and
Kochmann, Phys. Rev. B 93, 104109, 2016).

A front of speed v turns the energy that every cell sets free into heat: gain = c <sum u'^2> / v.
So its kinetic energy is m v gain / (2 c), whatever the coupling and the wells.
"""

import numpy as np
import pytest
from scipy.optimize import brentq

from mlmem_lab.lattices import Lattice, Linear, Phi4, PowerLaw

TILT = 0.08
"""Of a double well (x^2 - 1)^2 / 4, whose left side becomes the lower one."""

MAGNETS = PowerLaw(432.0, -3.0, 6.0)
"""Whose stiffness at rest, A |p| r^(p - 1), is that of the springs: 1."""

SITES = Phi4(0.25, -TILT)
N = 200
FROM, TO = 110, 170
"""Cells between which the front is steady: it has begun at 40."""


@pytest.mark.parametrize('damping', [0.1, 0.3])
@pytest.mark.parametrize('coupling', [Linear(), MAGNETS], ids=['springs', 'magnets'])
def test_a_front_carries_the_kinetic_energy_of_the_universal_law(coupling, damping):
    low, high = (brentq(SITES.slope, *between) for between in ((-2.0, -0.8), (0.8, 2.0)))
    gain = float(SITES.energy(high) - SITES.energy(low))
    chain = Lattice(SITES, coupling, np.ones(N), 0.05, damping=damping)
    chain.place(np.where(np.arange(N) < 40, low, high))
    times, kinetic = [], []
    while (front := np.sum(chain.displacement < 0.0)) < TO:
        if front >= FROM:
            times.append(chain.time)
            kinetic.append(0.5 * np.sum(chain.velocity**2))
        chain.advance(5)
    speed = (TO - FROM) / (chain.time - times[0])
    # 60 cells pass: the energy, which swings as each does, is averaged to a part in a thousand.
    assert np.mean(kinetic) == pytest.approx(speed * gain / (2.0 * damping), rel=2e-3)
