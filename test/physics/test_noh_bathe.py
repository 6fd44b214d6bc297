# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The integrator, by properties that do not depend on its constants.

=========================  =========================================================
property                   must agree with
=========================  =========================================================
weights of the corrector   exact for accelerations constant and linear in time
a damped oscillator        its closed form; the error falls with dt^2
stability                  bounded below omega dt = 3.745, growing above (Noh & Bathe)
damping                    lowers that limit: x^2 + 2 eta dt / 3.745 = 1
=========================  =========================================================
"""

import dataclasses
import math

import numpy as np
import pytest
import uniform_chain

from mlmem.physics import NOH_BATHE
from mlmem.physics.methods.noh_bathe import compute_coefficients


@pytest.mark.parametrize('p', [0.3, 0.5, 0.54, 0.7])
def test_corrector_is_exact_for_linear_accelerations(p):
    dt = 0.7
    _, _, a2, _, _, a5, a6, a7 = compute_coefficients(dt, p)
    first, second = p * dt, (1.0 - p) * dt
    assert 2.0 * a2 == pytest.approx(first)
    assert a5 + a6 + a7 == pytest.approx(second)  # A(t) = 1
    assert a6 * first + a7 * dt == pytest.approx(0.5 * (dt**2 - first**2))  # A(t) = t


@pytest.mark.parametrize('eta', [0.0, 1 / 250, 0.3])
@pytest.mark.parametrize('phase', [1, 2], ids=['s1', 's2'])
def test_oscillator_follows_closed_form_to_second_order(phase, eta):
    design = dataclasses.replace(uniform_chain.UNIFORM, phase=phase, eta=eta)
    order, error = uniform_chain.order(design, (0.4, 0.2, 0.1), NOH_BATHE)
    assert order == pytest.approx(2.0, abs=0.05)
    # With p = 0.54 the phase is ahead by (omega dt)^2 / 166 of the angle turned.
    omega = math.sqrt(design.k_s1)
    assert error < 1.1 * (0.1 * omega) ** 2 / 166 * 24.0 * omega


def test_stable_up_to_published_limit(monkeypatch):
    """Up to 3.745: the roots part at 2 / p = 3.704, the larger leaves the circle at 3.745."""
    assert uniform_chain.growth(monkeypatch, 3.60, NOH_BATHE) < 1.0
    assert uniform_chain.growth(monkeypatch, 3.74, NOH_BATHE) < 1.0
    assert uniform_chain.growth(monkeypatch, 3.75, NOH_BATHE) > 1e3


@pytest.mark.parametrize('eta', [0.1, 0.5, 2.0])
def test_damping_lowers_limit(monkeypatch, eta):
    """The limit of omega dt / 3.745 with explicit damping: x^2 + 2 eta dt / 3.745 = 1."""
    p = uniform_chain.UNIFORM
    omega = math.sqrt(p.k_s1 + 2.0 + 2.0 * math.cos(np.pi / p.N))
    limit = 3.745 * (math.hypot(omega, eta) - eta) / omega
    assert uniform_chain.growth(monkeypatch, 0.98 * limit, NOH_BATHE, eta) < 1.0
    assert uniform_chain.growth(monkeypatch, 1.03 * limit, NOH_BATHE, eta) > 1e3


@pytest.mark.parametrize('substrate', ['rigid', 'elastic'])
@pytest.mark.parametrize('eta', [0.0, 1 / 250, 1.0, 10.0])
def test_stable_step_is_stable_and_not_too_small(substrate, eta):
    chain = uniform_chain.at_the_stable_step(substrate, eta, NOH_BATHE)
    fastest = 2.0 * math.sqrt(chain.design.s.max()) if substrate == 'elastic' else 2.14
    damped = (math.hypot(fastest, eta) - eta) / fastest
    assert 0.9 < chain.dt * fastest / (3.6 * damped) <= 0.951
