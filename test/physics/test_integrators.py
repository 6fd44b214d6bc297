# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The integrators, by properties that do not depend on their constants, and dry friction.

=========================  =========================================================
property                   must agree with
=========================  =========================================================
a damped oscillator        its closed form; the error falls with dt^2, of PEFRL with dt^4
stability                  bounded below omega dt = 3.745 (PEFRL: 2.9895), growing above
a step of PEFRL            shrinks the volume of states as the damping does, no more
energy                     kept by PEFRL, where the paper's method loses a third
=========================  =========================================================

`test_chain` has both follow DOP853 through strain, pulse and damping, `test_specimen` with cells
of their own masses on a base that shakes.
"""

import dataclasses
import math

import numpy as np
import pytest

import mlmem
from mlmem.physics import CASE_II, NOH_BATHE, PEFRL, Chain, StateError, stable_step
from mlmem.physics.energy import energy
from mlmem.physics.equilibrium import find_pinned_wall

UNIFORM = dataclasses.replace(CASE_II, N=26, gamma=0.0, beta=0.0)
"""Shifted as a whole it stretches no spring: all cells are one oscillator of stiffness k_s."""


def measure_oscillator_error(design, dt, method, time=24.0):
    """Return the largest error of a damped oscillator that starts at 1, at rest."""
    amplitude = 1e-6  # harmonic to 1e-6, and 1e10 roundings high
    chain = Chain(design, dt, method)
    chain.place(np.full(design.N, design.D_s1 + amplitude))
    steps = round(time / dt)
    v_1, v_N = (chain.advance_steps(steps) - design.D_s1) / amplitude
    np.testing.assert_allclose(v_N, v_1, atol=1e-8)  # as a whole
    t, eta = dt * np.arange(1, steps + 1), design.eta
    omega = math.sqrt(design.k_s1 - 0.25 * eta * eta)
    exact = np.cos(omega * t) + 0.5 * eta / omega * np.sin(omega * t)
    return np.abs(v_1 - np.exp(-0.5 * eta * t) * exact).max()


def measure_order(design, steps, method):
    """Return the order of a method, and its error at the last of some steps."""
    errors = [measure_oscillator_error(design, dt, method) for dt in steps]
    return np.polyfit(np.log(steps), np.log(errors), 1)[0], errors[-1]


def phase_error(design, dt, time=24.0):
    """Return the error of the paper's method: it is ahead by (omega dt)^2 / 166 of the angle."""
    omega = math.sqrt(design.k_s1)
    return (dt * omega) ** 2 / 166 * time * omega


@pytest.mark.parametrize('eta', [0.0, 1 / 250, 0.3, 5.0])
def test_step_shrinks_volume_of_states_by_damping_alone(eta):
    """Liouville: det = exp(-eta dt), whatever the stiffness and the step."""
    for dt in (0.1, 0.5, 1.2):
        matrix = PEFRL.step_matrix(np.array([0.1, 1.0, 4.5], dtype=complex), eta, dt)
        np.testing.assert_allclose(np.linalg.det(matrix), math.exp(-eta * dt), rtol=1e-13)


def test_undamped_packet_keeps_its_energy():
    """In 2000 time units; at a step of 0.25 the paper's method loses more than a third of it."""
    design = dataclasses.replace(CASE_II, eta=0.0)
    rest = find_pinned_wall(design, 3)
    packet = 0.01 * np.exp(-(((design.sites - 40.0) / 8.0) ** 2)) * np.sin(1.2 * design.sites)
    kept = {}
    for method in (PEFRL, NOH_BATHE):
        chain = Chain(design, integrator=method)
        chain.place(rest)
        ground = energy(chain).total
        chain.place(rest + packet)
        start = energy(chain).total - ground
        chain.advance_steps(round(2000.0 / chain.dt))
        kept[method.name] = (energy(chain).total - ground) / start
    assert kept['pefrl'] == pytest.approx(1.0, abs=3e-3)  # it swings by (omega dt)^4 / 1000
    assert kept['noh_bathe'] < 0.8


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
@pytest.mark.parametrize(
    ('method', 'phase', 'steps', 'order', 'tolerance'),
    [
        (NOH_BATHE, 1, (0.4, 0.2, 0.1), 2.0, 0.05),
        (NOH_BATHE, 2, (0.4, 0.2, 0.1), 2.0, 0.05),
        (PEFRL, 2, (1.2, 0.8, 0.6), 4.0, 0.15),
    ],
)
def test_oscillator_follows_closed_form_to_order(method, phase, steps, order, tolerance, eta):
    design = dataclasses.replace(UNIFORM, phase=phase, eta=eta)
    found, error = measure_order(design, steps, method)
    assert found == pytest.approx(order, abs=tolerance)
    # The paper's method: 1e-2 at 0.3, for as many forces as PEFRL at 0.6.
    assert error < (1e-3 if method is PEFRL else 1.1 * phase_error(design, steps[-1]))


def measure_growth(monkeypatch, omega_dt, method, eta=0.0, steps=400):
    """Return by how much the fastest wave of a uniform chain has grown at its highest."""
    monkeypatch.setattr(type(method), 'stable_turn', 100.0)
    p = dataclasses.replace(UNIFORM, eta=eta)
    kappa = np.pi * (p.N - 1) / p.N
    omega = math.sqrt(p.k_s1 + 2.0 - 2.0 * math.cos(kappa))
    chain = Chain(p, omega_dt / omega, method)
    wave = np.cos(kappa * (p.sites - 0.5))
    chain.place(p.D_s1 + 1e-9 * wave / wave[0])
    try:
        return np.abs(chain.advance_steps(steps) - p.D_s1).max() / 1e-9
    except StateError:  # beyond all numbers
        return math.inf


@pytest.mark.parametrize(
    ('method', 'omega_dt', 'most'),
    [
        (NOH_BATHE, 3.60, 1.0),
        (NOH_BATHE, 3.74, 1.0),  # the roots part at 2 / p = 3.704, the larger grows above 3.745
        (NOH_BATHE, 3.75, math.inf),
        (PEFRL, 2.98, 20.0),  # near the limit the ellipse is long, and bounded
        (PEFRL, 3.0, math.inf),
    ],
)
def test_step_is_stable_up_to_published_limit(monkeypatch, method, omega_dt, most):
    grown = measure_growth(monkeypatch, omega_dt, method)
    assert grown < most if most < math.inf else grown > 1e3


def advance_at_stable_step(substrate, eta, method):
    """Return a chain after a rough start at the largest step allowed."""
    design = dataclasses.replace(CASE_II, N=60, substrate=substrate, eta=eta)
    chain = Chain(design, stable_step(design, method), method)
    chain.place(design.D_s1 + 1e-3 * np.random.default_rng(1).standard_normal(design.N))
    chain.advance_steps(4000)
    assert np.abs(chain.v - design.D_s1).max() < 5e-3
    return chain


@pytest.mark.parametrize('method', [NOH_BATHE, PEFRL])
@pytest.mark.parametrize('substrate', ['rigid', 'elastic'])
@pytest.mark.parametrize('eta', [0.0, 1 / 250, 1.0, 10.0])
def test_stable_step_is_stable_and_not_too_small(substrate, eta, method):
    chain = advance_at_stable_step(substrate, eta, method)
    fastest = 2.0 * math.sqrt(chain.design.s.max()) if substrate == 'elastic' else 2.14
    damped = (math.hypot(fastest, eta) - eta) / fastest
    if method is NOH_BATHE:
        assert 0.9 < chain.dt * fastest / (3.6 * damped) <= 0.951
