# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Energy: its gradient gives the forces. `test_integrators` has it conserved.

=====================  =============================================================
quantity               must agree with
=====================  =============================================================
terms                  those of the Lagrangian as printed above Eq. (1)
force on the end       the slope of the energy
=====================  =============================================================
"""

import dataclasses

import numpy as np
import oracle
import pytest

from mlmem.physics import CASE_II, Chain, Specimen
from mlmem.physics.energy import end_force, energy
from mlmem.physics.equilibrium import compute_energies

SUBSTRATES = pytest.mark.parametrize('substrate', ['rigid', 'elastic'])
SMALL = dataclasses.replace(CASE_II, N=60)


def potential_energy(design, v, V):
    """Return the energy of displacements at rest."""
    return sum(compute_energies(Specimen(design), v, V))


def rough():
    """Return displacements v with a wall and everything out of balance."""
    random = np.random.default_rng(0)
    return np.where(SMALL.sites < 30, SMALL.D_s2, SMALL.D_s1) + 0.3 * random.standard_normal(60)


@SUBSTRATES
def test_end_force_is_slope_of_energy(substrate):
    """Moving V_N moves the whole foundation of the rigid model, one site of the elastic one."""
    design = dataclasses.replace(SMALL, substrate=substrate)
    v = rough()
    chain = Chain(design)
    chain.place(v, V_N=0.7)
    moved = oracle.quasi_static(design) if substrate == 'rigid' else np.eye(design.N)[-1]
    V, h = 0.7 * oracle.quasi_static(design), 1e-5
    slope = potential_energy(design, v, V + h * moved) - potential_energy(design, v, V - h * moved)
    assert end_force(chain, chain.v, chain.V) == pytest.approx(slope / (2.0 * h), abs=1e-6)


@SUBSTRATES
def test_energy_is_the_sum_of_the_printed_terms(substrate):
    design = dataclasses.replace(SMALL, substrate=substrate)
    chain = Chain(design)
    chain.place(rough(), V_N=0.4)
    chain.advance(0.4 + 0.01 * np.arange(40))
    parts = energy(chain)
    speeds = np.concatenate((chain.velocity, chain.substrate_velocity))
    assert parts.kinetic == pytest.approx(0.5 * np.sum(speeds**2), rel=1e-14)
    on_site = np.sum(oracle.alpha(design) * oracle.psi(design, chain.configuration))
    assert parts.on_site == pytest.approx(on_site, rel=1e-13)
    assert parts.coupling == pytest.approx(0.5 * np.sum(np.diff(chain.v) ** 2), rel=1e-14)
    assert parts.substrate == pytest.approx(
        0.5 * np.sum(oracle.s(design) * np.diff(chain.V) ** 2), rel=1e-12
    )
    statics = parts.coupling + parts.on_site + parts.substrate
    assert parts.total == pytest.approx(parts.kinetic + statics, rel=1e-15)
    assert parts.kinetic > 0.0
