# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Energy and its loss: its terms, the force that is its slope, and what a step does to it.

=====================  =============================================================
quantity               must agree with
=====================  =============================================================
terms                  those of the Lagrangian as printed above Eq. (1)
forces                 slopes of the energy: on a cell, below it, and on the end
a step                 shrinks the volume of states as the damping does, no more
stability              bounded below omega dt = 2.9895, growing above
an undamped packet     keeps its energy
dry friction           takes 2 F / k from every half swing
=====================  =============================================================

`test_chain` has the integrator follow DOP853 through strain, pulse and damping, with an error that
falls with dt^4, `test_specimen` with cells of their own masses on a base that shakes.
"""

import dataclasses
import math

import numpy as np
import oracle
import pytest

import mlmem
from mlmem.physics import CASE_II, Chain, Scatter, draw_specimen, pefrl, stable_step
from mlmem.physics.energy import end_force, energy
from mlmem.physics.equilibrium import (
    compute_energies,
    find_pinned_wall,
    metamaterial_force,
    substrate_force,
)

SUBSTRATES = pytest.mark.parametrize('substrate', ['rigid', 'elastic'])
SMALL = dataclasses.replace(CASE_II, N=60)


def scattered(substrate):
    """Return an element whose cells and springs differ."""
    depth = 0.2 if substrate == 'rigid' else 0.0
    scatter = Scatter(alpha=0.1, k_r=0.1, s=0.1, mass=0.1, offset=0.05, depth=depth)
    return draw_specimen(dataclasses.replace(SMALL, substrate=substrate), scatter, 1)


def rough():
    """Return displacements v with a wall and everything out of balance."""
    random = np.random.default_rng(0)
    return np.where(SMALL.sites < 30, SMALL.D_s2, SMALL.D_s1) + 0.3 * random.standard_normal(60)


@SUBSTRATES
def test_forces_are_slopes_of_energy(substrate):
    """Moving V_N moves the whole foundation of the rigid model, one site of the elastic one."""
    made = scattered(substrate)
    chain, h = Chain(made), 1e-5
    chain.place(rough(), V_N=0.7)
    v, V = chain.v, 0.7 * oracle.quasi_static(SMALL, made.s_factor)
    cell, end = np.eye(SMALL.N)[[9, -1]]

    def slope(by_v, by_V):
        up, down = (sum(compute_energies(made, v + k * by_v, V + k * by_V)) for k in (h, -h))
        return pytest.approx((up - down) / (2.0 * h), abs=1e-6)

    moved = made.strain_shape if substrate == 'rigid' else end
    assert end_force(chain, v, chain.V) == slope(0.0, moved)
    assert -metamaterial_force(made, v, V)[9] == slope(cell, 0.0)
    assert -substrate_force(made, v, V)[9] == slope(0.0, cell)


@SUBSTRATES
def test_energy_is_the_sum_of_the_printed_terms(substrate):
    made = scattered(substrate)
    chain = Chain(made)
    chain.place(rough(), V_N=0.4)
    chain.advance(0.4 + 0.01 * np.arange(40))
    parts = energy(chain)
    moving = np.sum(made.masses * chain.velocity**2) + np.sum(chain.substrate_velocity**2)
    assert parts.kinetic == pytest.approx(0.5 * moving, rel=1e-14)
    D = chain.configuration - made.offsets
    wells = oracle.alpha(SMALL) * made.alpha_factor * oracle.psi(SMALL, D)
    wells -= made.depth_force * (D - SMALL.D_s1)
    assert parts.on_site == pytest.approx(np.sum(wells), rel=1e-12)
    stretched = made.k_r_factor * np.diff(chain.v) ** 2
    assert parts.coupling == pytest.approx(0.5 * np.sum(stretched), rel=1e-14)
    below = oracle.s(SMALL) * made.s_factor * np.diff(chain.V) ** 2
    assert parts.substrate == pytest.approx(0.5 * np.sum(below), rel=1e-12)
    statics = parts.coupling + parts.on_site + parts.substrate
    assert parts.total == pytest.approx(parts.kinetic + statics, rel=1e-15)
    assert parts.kinetic > 0.0


@pytest.mark.parametrize('eta', [0.0, 1 / 250, 0.3, 5.0])
def test_step_shrinks_volume_of_states_by_damping_alone(eta):
    """Liouville: det = exp(-eta dt), whatever the stiffness and the step."""
    for dt in (0.1, 0.5, 1.2):
        matrix = pefrl.step_matrix(np.array([0.1, 1.0, 4.5], dtype=complex), eta, dt)
        np.testing.assert_allclose(np.linalg.det(matrix), math.exp(-eta * dt), rtol=1e-13)


def test_step_is_stable_up_to_published_limit():
    """It is 2.9895: below, the factors of a step are of size 1; above, waves grow."""
    for phase, largest in ((pefrl.MAX_STABLE_PHASE, 1.0), (3.0, 1.067)):
        step = pefrl.step_matrix(np.array([phase**2], dtype=complex), 0.0, 1.0)
        assert np.abs(np.linalg.eigvals(step)).max() == pytest.approx(largest, abs=1e-3)


def test_undamped_packet_keeps_its_energy():
    """In 2000 time units."""
    design = dataclasses.replace(CASE_II, eta=0.0)
    rest = find_pinned_wall(design, 3)
    packet = 0.01 * np.exp(-(((design.sites - 40.0) / 8.0) ** 2)) * np.sin(1.2 * design.sites)
    chain = Chain(design)
    chain.place(rest)
    ground = energy(chain).total
    chain.place(rest + packet)
    start = energy(chain).total - ground
    chain.advance_steps(round(2000.0 / chain.dt))
    kept = (energy(chain).total - ground) / start
    assert kept == pytest.approx(1.0, abs=3e-3)  # it swings by (omega dt)^4 / 1000


def test_friction_takes_same_amplitude_from_every_swing():
    """All cells swing alike about s1: each half period takes 2 F / k, exactly for a linear
    force.
    """
    friction, amplitude = 2e-5, 1e-2
    design = dataclasses.replace(CASE_II, N=30, gamma=0.0, beta=0.0, eta=0.0, friction=friction)
    half_period = math.pi / math.sqrt(design.k_s1)
    run = mlmem.simulate(
        design,
        initial=np.full(design.N, design.D_s1 + amplitude),
        duration=4.0 * half_period,
        save_every=half_period / 100.0,
        progress=False,
    )
    swings = run.configuration[::100, 15] - design.D_s1
    loss = 2.0 * friction / design.k_s1
    expected = [(-1) ** n * (amplitude - n * loss) for n in range(5)]
    # 5 %: the force is linear up to 2 % at this amplitude, and friction viscous near rest.
    assert np.abs(swings - expected).max() < 0.05 * 4.0 * loss


@SUBSTRATES
@pytest.mark.parametrize('eta', [0.0, 1 / 250, 1.0, 10.0])
def test_stable_step_is_stable_and_not_too_small(substrate, eta):
    """A rough start stays small at the largest step allowed."""
    design = dataclasses.replace(SMALL, substrate=substrate, eta=eta)
    chain = Chain(design, stable_step(design))
    chain.place(design.D_s1 + 1e-3 * np.random.default_rng(1).standard_normal(design.N))
    chain.advance_steps(4000)
    assert np.abs(chain.v - design.D_s1).max() < 5e-3
    fastest = 2.0 * math.sqrt(design.s.max()) if substrate == 'elastic' else 2.14
    assert 0.9 < chain.dt * fastest / pefrl.MAX_STABLE_PHASE <= 0.951
