# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The integrator, by properties that do not depend on its constants, and dry friction.

=========================  =========================================================
property                   must agree with
=========================  =========================================================
a damped oscillator        its closed form; the error falls with dt^4
stability                  bounded below omega dt = 2.9895, growing above
a step                     shrinks the volume of states as the damping does, no more
energy                     kept
=========================  =========================================================

`test_chain` has it follow DOP853 through strain, pulse and damping, `test_specimen` with cells
of their own masses on a base that shakes.
"""

import dataclasses
import math

import numpy as np
import pytest

import mlmem
from mlmem.physics import CASE_II, Chain, pefrl, stable_step
from mlmem.physics.energy import energy
from mlmem.physics.equilibrium import find_pinned_wall

UNIFORM = dataclasses.replace(CASE_II, N=26, gamma=0.0, beta=0.0)
"""Shifted as a whole it stretches no spring: all cells are one oscillator of stiffness k_s."""


def measure_oscillator_error(design, dt, time=24.0):
    """Return the largest error of a damped oscillator that starts at 1, at rest."""
    amplitude = 1e-6  # harmonic to 1e-6, and 1e10 roundings high
    chain = Chain(design, dt)
    chain.place(np.full(design.N, design.D_s1 + amplitude))
    steps = round(time / dt)
    v_1, v_N = (chain.advance_steps(steps) - design.D_s1) / amplitude
    np.testing.assert_allclose(v_N, v_1, atol=1e-8)  # as a whole
    t, eta = dt * np.arange(1, steps + 1), design.eta
    omega = math.sqrt(design.k_s1 - 0.25 * eta * eta)
    exact = np.cos(omega * t) + 0.5 * eta / omega * np.sin(omega * t)
    return np.abs(v_1 - np.exp(-0.5 * eta * t) * exact).max()


def measure_order(design, steps):
    """Return the order of the method, and its error at the last of some steps."""
    errors = [measure_oscillator_error(design, dt) for dt in steps]
    return np.polyfit(np.log(steps), np.log(errors), 1)[0], errors[-1]


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


@pytest.mark.parametrize('eta', [0.0, 1 / 250, 0.3])
def test_oscillator_follows_closed_form_to_fourth_order(eta):
    design = dataclasses.replace(UNIFORM, phase=2, eta=eta)
    order, error = measure_order(design, (1.2, 0.8, 0.6))
    assert order == pytest.approx(4.0, abs=0.15)
    assert error < 1e-3


@pytest.mark.parametrize('substrate', ['rigid', 'elastic'])
@pytest.mark.parametrize('eta', [0.0, 1 / 250, 1.0, 10.0])
def test_stable_step_is_stable_and_not_too_small(substrate, eta):
    """A rough start stays small at the largest step allowed."""
    design = dataclasses.replace(CASE_II, N=60, substrate=substrate, eta=eta)
    chain = Chain(design, stable_step(design))
    chain.place(design.D_s1 + 1e-3 * np.random.default_rng(1).standard_normal(design.N))
    chain.advance_steps(4000)
    assert np.abs(chain.v - design.D_s1).max() < 5e-3
    fastest = 2.0 * math.sqrt(design.s.max()) if substrate == 'elastic' else 2.14
    assert 0.9 < chain.dt * fastest / pefrl.MAX_STABLE_PHASE <= 0.951
