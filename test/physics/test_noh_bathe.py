# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The integrator, by properties that do not depend on its constants.

=========================  =========================================================
property                   must agree with
=========================  =========================================================
weights of the corrector   exact for accelerations constant and linear in time
a damped oscillator        its closed form; the error falls with dt^2
p = 1/2                    two velocity Verlet half steps, written out in plain Python
stability                  bounded below omega dt = 3.745, growing above (Noh & Bathe)
damping                    lowers that limit: x^2 + 2 eta dt / 3.745 = 1
=========================  =========================================================
"""

import dataclasses
import math

import numpy as np
import pytest
import uniform_chain

from mlmem.physics import CASE_II, NOH_BATHE
from mlmem.physics.methods.integrator import Cells, Forcing
from mlmem.physics.methods.noh_bathe import advance, compute_coefficients


@pytest.mark.parametrize('p', [0.3, 0.5, 0.54, 0.7])
def test_the_corrector_is_exact_for_linear_accelerations(p):
    dt = 0.7
    _, _, a2, _, _, a5, a6, a7 = compute_coefficients(dt, p)
    first, second = p * dt, (1.0 - p) * dt
    assert 2.0 * a2 == pytest.approx(first)
    assert a5 + a6 + a7 == pytest.approx(second)  # A(t) = 1
    assert a6 * first + a7 * dt == pytest.approx(0.5 * (dt**2 - first**2))  # A(t) = t


@pytest.mark.parametrize('eta', [0.0, 1 / 250, 0.3])
@pytest.mark.parametrize('phase', [1, 2], ids=['s1', 's2'])
def test_an_oscillator_follows_its_closed_form_to_second_order(phase, eta):
    design = dataclasses.replace(uniform_chain.UNIFORM, phase=phase, eta=eta)
    order, error = uniform_chain.order(design, (0.4, 0.2, 0.1), NOH_BATHE)
    assert order == pytest.approx(2.0, abs=0.05)
    # With p = 0.54 the phase is ahead by (omega dt)^2 / 166 of the angle turned.
    omega = math.sqrt(design.k_s1)
    assert error < 1.1 * (0.1 * omega) ** 2 / 166 * 24.0 * omega


# --- p = 1/2 ----------------------------------------------------------------------------------


def verlet(p, u, v, ramp, h):
    """Step the chain by velocity Verlet of step h, cell by cell, as a textbook has it.

    The explicit damping of step n uses the velocity predicted from step n - 1.
    """
    n = p.N

    def acceleration(u, velocity, V_N):
        result = []
        for j in range(n):
            y = u[j] - V_N * p.strain_shape[j] + p.c
            slope = p.d * math.sin(p.a * y + p.b * y**3) * (p.a + 3 * p.b * y**2)
            left = u[j - 1] - u[j] if j > 0 else 0.0
            right = u[j + 1] - u[j] if j < n - 1 else 0.0
            result.append(left + right - p.alpha[j] * slope - p.eta * velocity[j])
        return result

    a = acceleration(u, v, 0.0)
    for V_N in ramp:
        u = [x + h * y + 0.5 * h * h * z for x, y, z in zip(u, v, a, strict=True)]
        new = acceleration(u, [y + h * z for y, z in zip(v, a, strict=True)], V_N)
        v = [y + 0.5 * h * (z + w) for y, z, w in zip(v, a, new, strict=True)]
        a = new
    return np.array(u), np.array(v), np.array(a)


def test_half_and_half_is_velocity_verlet():
    """On a whole nonlinear element: a wall, a ramp of strain, damping, defects."""
    p = dataclasses.replace(CASE_II, N=60, eta=0.1)
    dt, steps = 0.2, 100
    start = np.where(p.sites < 28, p.D_s2, p.D_s1) + 0.1 * np.sin(p.sites)
    velocity = 0.05 * np.cos(3.0 * p.sites)
    ramp = 2.0 * np.sin(0.1 * np.arange(1, 2 * steps + 1))
    u, v, a = verlet(p, start.tolist(), velocity.tolist(), ramp, dt / 2)

    field = np.pad(start, 1)
    speed = velocity.copy()
    acceleration = verlet(p, start.tolist(), velocity.tolist(), [], dt / 2)[2]
    chain = field, speed, acceleration, np.zeros(p.N + 2), np.zeros(p.N), np.zeros(p.N)
    cells = Cells(
        law=(p.alpha * p.d, p.a, p.b), spring=(), origin=np.full(p.N, -p.c),
        mobility=np.ones(p.N), substrate=p.strain_shape.copy(),
        stuck=np.empty(0, dtype=np.int64), eta=p.eta,
    )  # fmt: skip
    forcing = Forcing(ramp, np.zeros(2 * steps), site=1, driven=0, motion=np.zeros((2, 1)))
    ends = np.empty((2, steps))
    advance(
        steps,
        chain,
        None,
        cells,
        forcing,
        np.array(compute_coefficients(dt, p=0.5)),
        ends,
        None,
        None,
    )
    # The same sums in another order: some roundings per step, not yet spread by chaos.
    np.testing.assert_allclose(field[1:-1], u, atol=1e-12)
    np.testing.assert_allclose(speed, v, atol=1e-12)
    np.testing.assert_allclose(acceleration, a, atol=1e-12)
    np.testing.assert_array_equal(ends[:, -1], field[[1, p.N]])


# --- stability --------------------------------------------------------------------------------


def test_stable_up_to_the_published_limit(monkeypatch):
    """Up to 3.745: the roots part at 2 / p = 3.704, the larger leaves the circle at 3.745."""
    assert uniform_chain.growth(monkeypatch, 3.60, NOH_BATHE) < 1.0
    assert uniform_chain.growth(monkeypatch, 3.74, NOH_BATHE) < 1.0
    assert uniform_chain.growth(monkeypatch, 3.75, NOH_BATHE) > 1e3


@pytest.mark.parametrize('eta', [0.1, 0.5, 2.0])
def test_damping_lowers_the_limit(monkeypatch, eta):
    """The limit of omega dt / 3.745 with explicit damping: x^2 + 2 eta dt / 3.745 = 1."""
    p = uniform_chain.UNIFORM
    omega = math.sqrt(p.k_s1 + 2.0 + 2.0 * math.cos(np.pi / p.N))
    limit = 3.745 * (math.hypot(omega, eta) - eta) / omega
    assert uniform_chain.growth(monkeypatch, 0.98 * limit, NOH_BATHE, eta) < 1.0
    assert uniform_chain.growth(monkeypatch, 1.03 * limit, NOH_BATHE, eta) > 1e3


@pytest.mark.parametrize('substrate', ['rigid', 'elastic'])
@pytest.mark.parametrize('eta', [0.0, 1 / 250, 1.0, 10.0])
def test_the_stable_step_is_stable_and_not_too_small(substrate, eta):
    chain = uniform_chain.at_the_stable_step(substrate, eta, NOH_BATHE)
    fastest = 2.0 * math.sqrt(chain.design.s.max()) if substrate == 'elastic' else 2.14
    damped = (math.hypot(fastest, eta) - eta) / fastest
    assert 0.9 < chain.dt * fastest / (3.6 * damped) <= 0.951
