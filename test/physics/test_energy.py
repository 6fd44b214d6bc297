# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Energy: its gradient gives the forces. `test_integrators` has it conserved.

=====================  =============================================================
quantity               must agree with
=====================  =============================================================
potential energy       the Lagrangian as printed above Eq. (1)
forces                 Eqs. (1a) and (1b) as printed
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


def rough(seed=0):
    """Return displacements v and V with a wall and everything out of balance."""
    random = np.random.default_rng(seed)
    v = np.where(SMALL.sites < 30, SMALL.D_s2, SMALL.D_s1) + 0.3 * random.standard_normal(SMALL.N)
    return v, 0.1 * random.standard_normal(SMALL.N)


def test_potential_energy_is_the_printed_lagrangian():
    v, V = rough()
    on_site = np.sum(oracle.alpha(SMALL) * oracle.psi(SMALL, v - V))
    s = oracle.s(SMALL)
    springs = sum(
        0.5 * ((v[j] - v[j + 1]) ** 2 + s[j] * (V[j] - V[j + 1]) ** 2) for j in range(SMALL.N - 1)
    )
    assert potential_energy(SMALL, v, V) == pytest.approx(on_site + springs, rel=1e-13)


@SUBSTRATES
def test_end_force_is_slope_of_energy(substrate):
    """Moving V_N moves the whole foundation of the rigid model, one site of the elastic one."""
    design = dataclasses.replace(SMALL, substrate=substrate)
    v, _ = rough()
    chain = Chain(design)
    chain.place(v, V_N=0.7)
    moved = oracle.quasi_static(design) if substrate == 'rigid' else np.eye(design.N)[-1]
    V, h = 0.7 * oracle.quasi_static(design), 1e-5
    slope = potential_energy(design, v, V + h * moved) - potential_energy(design, v, V - h * moved)
    assert end_force(chain, chain.v, chain.V) == pytest.approx(slope / (2.0 * h), abs=1e-6)


@SUBSTRATES
def test_energy_is_the_sum_of_its_parts(substrate):
    design = dataclasses.replace(SMALL, substrate=substrate)
    chain = Chain(design)
    chain.place(rough()[0], V_N=0.4)
    chain.advance(0.4 + 0.01 * np.arange(40))
    parts = energy(chain)
    speeds = np.concatenate((chain.velocity, chain.substrate_velocity))
    assert parts.kinetic == pytest.approx(0.5 * np.sum(speeds**2), rel=1e-14)
    statics = parts.coupling + parts.on_site + parts.substrate
    assert statics == pytest.approx(potential_energy(design, chain.v, chain.V), rel=1e-14)
    assert parts.coupling == pytest.approx(0.5 * np.sum(np.diff(chain.v) ** 2), rel=1e-14)
    assert parts.substrate == pytest.approx(
        0.5 * np.sum(oracle.s(design) * np.diff(chain.V) ** 2), rel=1e-12
    )
    assert parts.total == pytest.approx(parts.kinetic + statics, rel=1e-15)
    assert parts.kinetic > 0.0
