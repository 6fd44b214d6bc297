# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Energy: it gives the forces, and none is lost.

=====================  =============================================================
quantity               must agree with
=====================  =============================================================
potential energy       the Lagrangian as printed above Eq. (1)
forces                 its negative gradient; Eqs. (1a) and (1b) as printed
work of the actuator   stored + dissipated, while the strain is ramped
work of the pulse      stored + dissipated, while an end is driven
no work, no damping    the same energy for ever
=====================  =============================================================
"""

import dataclasses

import numpy as np
import oracle
import pytest

from mlmem_ros.physics import CASE_II, Chain, Drive, Specimen, substep_times
from mlmem_ros.physics.energy import actuator_force, damping_power, energy
from mlmem_ros.physics.equilibrium import resting_wall
from mlmem_ros.physics.statics import energies, metamaterial_force, substrate_force

SUBSTRATES = pytest.mark.parametrize('substrate', ['rigid', 'elastic'])
SMALL = dataclasses.replace(CASE_II, N=60)


def potential_energy(design, v, V):
    """Return the energy of displacements at rest."""
    return sum(energies(Specimen(design), v, V))


def rough(seed=0):
    """Return displacements v and V with a wall and everything out of balance."""
    random = np.random.default_rng(seed)
    v = np.where(SMALL.sites < 30, SMALL.D_s2, SMALL.D_s1) + 0.3 * random.standard_normal(SMALL.N)
    return v, 0.1 * random.standard_normal(SMALL.N)


def test_the_potential_energy_is_the_papers_lagrangian():
    v, V = rough()
    on_site = np.sum(oracle.alpha(SMALL) * oracle.psi(SMALL, v - V))
    s = oracle.s(SMALL)
    springs = sum(
        0.5 * ((v[j] - v[j + 1]) ** 2 + s[j] * (V[j] - V[j + 1]) ** 2) for j in range(SMALL.N - 1)
    )
    assert potential_energy(SMALL, v, V) == pytest.approx(on_site + springs, rel=1e-13)


def test_the_forces_are_those_of_eqs_1a_and_1b():
    v, V = rough()
    f, F = oracle.forces(SMALL, v, V)
    np.testing.assert_allclose(metamaterial_force(Specimen(SMALL), v, V), f, atol=1e-13)
    np.testing.assert_allclose(
        substrate_force(Specimen(SMALL), v, V), F, atol=1e-10
    )  # 3000 times more


@pytest.mark.parametrize('j', [0, 1, 24, 30, 58, 59])
def test_the_forces_are_minus_the_gradient_of_the_energy(j):
    """By central differences; h^2 psi''' and (energy 4000) eps / h are both below 1e-6."""
    v, V = rough()
    h = 1e-5 * np.eye(SMALL.N)[j]
    up, down = potential_energy(SMALL, v + h, V), potential_energy(SMALL, v - h, V)
    assert metamaterial_force(Specimen(SMALL), v, V)[j] == pytest.approx(
        -(up - down) / 2e-5, abs=1e-6
    )
    up, down = potential_energy(SMALL, v, V + h), potential_energy(SMALL, v, V - h)
    assert substrate_force(Specimen(SMALL), v, V)[j] == pytest.approx(
        -(up - down) / 2e-5, abs=1e-6
    )


@SUBSTRATES
def test_the_actuator_force_is_the_slope_of_the_energy(substrate):
    """Moving V_N moves the whole foundation of the rigid model, one site of the elastic one."""
    design = dataclasses.replace(SMALL, substrate=substrate)
    v, _ = rough()
    chain = Chain(design)
    chain.place(v, V_N=0.7)
    moved = oracle.quasi_static(design) if substrate == 'rigid' else np.eye(design.N)[-1]
    V, h = 0.7 * oracle.quasi_static(design), 1e-5
    slope = potential_energy(design, v, V + h * moved) - potential_energy(design, v, V - h * moved)
    assert actuator_force(chain) == pytest.approx(slope / (2.0 * h), abs=1e-6)


def test_a_bare_substrate_resists_like_its_springs_in_series():
    """Cells in their ground states everywhere pull at nothing: F = V_N / sum(1 / s)."""
    chain = Chain(dataclasses.replace(SMALL, substrate='elastic'))
    chain.place(SMALL.D_s1 + 0.5 * oracle.quasi_static(SMALL), V_N=0.5)
    assert actuator_force(chain) == pytest.approx(0.5 / np.sum(1.0 / oracle.s(SMALL)), rel=1e-9)


@SUBSTRATES
def test_the_parts_of_the_energy(substrate):
    design = dataclasses.replace(SMALL, substrate=substrate)
    chain = Chain(design)
    chain.place(rough()[0], V_N=0.4)
    chain.advance(0.4 + 0.01 * np.arange(40))
    parts = energy(chain)
    speeds = np.concatenate((chain.velocity, chain.substrate_velocity))
    assert parts.kinetic == pytest.approx(0.5 * np.sum(speeds**2), rel=1e-14)
    assert damping_power(chain) == pytest.approx(np.sum(speeds**2) / 250, rel=1e-14)
    statics = parts.coupling + parts.on_site + parts.substrate
    assert statics == pytest.approx(potential_energy(design, chain.v, chain.V), rel=1e-14)
    assert parts.coupling == pytest.approx(0.5 * np.sum(np.diff(chain.v) ** 2), rel=1e-14)
    assert parts.substrate == pytest.approx(
        0.5 * np.sum(oracle.s(design) * np.diff(chain.V) ** 2), rel=1e-12
    )
    assert parts.total == pytest.approx(parts.kinetic + statics, rel=1e-15)
    assert parts.kinetic > 0.0


@SUBSTRATES
def test_without_damping_and_work_the_energy_stays(substrate):
    """The integrator damps a little, the fastest waves most: less with the cube of the step."""
    design = dataclasses.replace(SMALL, eta=0.0, substrate=substrate)
    drifts = []
    for dt in (0.02, 0.01):
        chain = Chain(design, dt)
        wave = 0.3 * np.cos(np.pi * 5 * (design.sites - 0.5) / design.N)
        chain.place(design.D_s1 + wave)
        start = energy(chain).total
        assert start > 0.2
        chain.rest(round(200.0 / dt))
        drifts.append(abs(energy(chain).total / start - 1.0))
    assert drifts[0] < (1e-5 if substrate == 'rigid' else 2e-4)
    assert drifts[1] < drifts[0] / 3.5


def balance(chain, V_N, motion=None):
    """Run step by step; return the work of actuator and drive, the heat, the energy gained.

    Work and heat are summed by the trapezoidal rule, of second order as the integrator is. The
    force on a driven cell is what it takes to hold it, dU/dv_1, to accelerate it and to damp it.
    """
    design, dt = chain.design, chain.dt
    start = energy(chain).total
    work = drive_work = heat = 0.0
    force, power, pull = actuator_force(chain), damping_power(chain), None
    for k in range(len(V_N) // 2):
        before, position, speed = chain.V_N, chain.end(1), chain.velocity[0]
        if pull is None:
            pull = -metamaterial_force(Specimen(design), chain.v, chain.V)[0] + design.eta * speed
        here = slice(2 * k, 2 * k + 2)
        drive = None
        if motion is not None and motion[:, here].size:
            drive = Drive(1, motion[:, here])
        chain.advance(V_N[here], drive)
        new_force, new_power = actuator_force(chain), damping_power(chain)
        work += 0.5 * (force + new_force) * (chain.V_N - before)
        heat += 0.5 * (power + new_power) * dt
        force, power = new_force, new_power
        new_pull = -metamaterial_force(Specimen(design), chain.v, chain.V)[0]
        new_pull += design.eta * chain.velocity[0]
        if drive is not None:
            drive_work += 0.5 * (pull + new_pull) * (chain.end(1) - position)
            drive_work += 0.5 * (chain.velocity[0] ** 2 - speed**2)  # inertia
        pull = new_pull
    return work, drive_work, heat, energy(chain).total - start


@SUBSTRATES
def test_the_actuators_work_is_stored_or_dissipated(substrate):
    """A ramp (strain -0.05 in 25) fast enough to heat the chain."""
    design = dataclasses.replace(SMALL, eta=0.05, substrate=substrate)
    dt, steps = 0.02, 2500
    chain = Chain(design, dt)
    chain.place(resting_wall(Specimen(design), 0))
    V_N = -0.05 * design.N * oracle.smooth(substep_times(steps, dt) / 25.0)
    work, drive_work, heat, gain = balance(chain, V_N)
    assert drive_work == 0.0
    assert heat > 0.5
    # Nearly all of the 140 is in the substrate's springs, so measure by the heat.
    assert work == pytest.approx(gain + heat, abs=1e-4 * heat)


@SUBSTRATES
def test_the_pulses_work_is_stored_or_dissipated(substrate):
    design = dataclasses.replace(SMALL, eta=0.05, substrate=substrate)
    dt, steps = 0.02, 2000
    chain = Chain(design, dt)
    chain.place(resting_wall(Specimen(design), 0))
    t = substep_times(1500, dt)
    home, envelope = chain.end(1), 0.1 * np.exp(-0.5 * ((t - 15.0) / 4.0) ** 2)
    sine, cosine = np.sin(1.4 * t), 1.4 * np.cos(1.4 * t)
    motion = np.array([home + envelope * sine, envelope * (cosine - sine * (t - 15.0) / 16.0)])
    work, drive_work, heat, gain = balance(chain, np.zeros(2 * steps), motion)
    assert work == 0.0
    assert drive_work == pytest.approx(0.0478, abs=1e-3)
    assert 0.2 * drive_work < gain < 0.5 * drive_work  # the rest has become heat by now
    assert drive_work == pytest.approx(gain + heat, rel=3e-4)
