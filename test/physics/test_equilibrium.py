# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Static equilibria: against SciPy's minimiser, against a long damped run, and their meaning.

=====================  =============================================================
equilibrium            must agree with
=====================  =============================================================
relax                  scipy.optimize (trust-exact with the exact Hessian), from the
                       same guess; forces of the paper below rounding
find_pinned_wall       one anti-kink at the defect of every level; a chain put there stays
hold_walls             walls at their positions; the paper's forces balance but for those
                       that hold them
=====================  =============================================================
"""

import dataclasses

import numpy as np
import oracle
import pytest
from laws import sample_force
from scipy.optimize import minimize
from suite import expect_rejection

from mlmem.physics import CASE_I, CASE_II, Chain, Specimen, StateError, find_walls
from mlmem.physics.equilibrium import (
    find_pinned_wall,
    relax_to_equilibrium,
    solve_tridiagonal,
    wall_profile,
)
from mlmem.physics.held_wall import hold_walls

SMALL = dataclasses.replace(CASE_II, N=80)


def by_scipy(p, guess, V):
    """Return the minimum of the paper's potential energy next to a guess."""
    amplitude = oracle.alpha(p)

    def total(v):
        return np.sum(amplitude * oracle.psi(p, v - V)) + 0.5 * np.sum(np.diff(v) ** 2)

    def gradient(v):
        return -oracle.forces(p, v, V)[0]

    def hessian(v):
        h = 1e-6
        curvature = (oracle.psi_prime(p, v - V + h) - oracle.psi_prime(p, v - V - h)) / (2 * h)
        springs = np.diag(np.r_[1.0, np.full(p.N - 2, 2.0), 1.0])
        springs -= np.eye(p.N, k=1) + np.eye(p.N, k=-1)
        return springs + np.diag(amplitude * curvature)

    found = minimize(
        total,
        guess,
        jac=gradient,
        hess=hessian,
        method='trust-exact',
        options={'gtol': 1e-9, 'initial_trust_radius': 0.1},
    )
    assert np.linalg.eigvalsh(hessian(found.x)).min() > 0.0
    return found.x


@pytest.mark.parametrize('V_N', [0.0, -0.8, 1.2])
@pytest.mark.parametrize('position', [25.3, 37.8, 50.3])
def test_relax_finds_minimum_that_scipy_finds(position, V_N):
    V = V_N * oracle.quasi_static(SMALL)
    guess = wall_profile(SMALL, position) + V
    v = relax_to_equilibrium(SMALL, guess, V)
    # SciPy's force of 1e-9 over the softest stiffness, some 1e-2: the wall in its pinning site.
    np.testing.assert_allclose(v, by_scipy(SMALL, guess, V), atol=1e-7)
    assert np.abs(oracle.forces(SMALL, v, V)[0]).max() < 1e-11


def test_relax_rejects_unstable_equilibrium():
    summit = np.full(80, SMALL.D_barrier)
    uniform = dataclasses.replace(SMALL, gamma=0.0, beta=0.0)
    assert np.abs(oracle.forces(uniform, summit, np.zeros(80))[0]).max() < 1e-15
    with expect_rejection(StateError, 'conflict', 'v') as caught:
        relax_to_equilibrium(uniform, summit, np.zeros(80))
    assert 'unstable equilibrium; move' in str(caught.value)
    tipped = relax_to_equilibrium(uniform, summit + 1e-6, np.zeros(80))
    np.testing.assert_allclose(tipped, uniform.D_s2, atol=1e-9)


def test_relax_explains_why_it_failed():
    with pytest.raises(StateError, match=r'no equilibrium within 2 Newton steps; .* above 1e-12'):
        relax_to_equilibrium(SMALL, wall_profile(SMALL, 37.0), np.zeros(80), iterations=2)
    with expect_rejection(StateError, 'conflict', 'v'):
        relax_to_equilibrium(SMALL, np.full(80, np.nan), np.zeros(80))


@pytest.mark.parametrize('level', range(8))
def test_wall_rests_at_defect_of_every_level(level):
    v = find_pinned_wall(CASE_II, level)
    (wall,) = find_walls(CASE_II, v)
    assert wall.anti_kink
    assert wall.position == pytest.approx(CASE_II.defect_site(level), abs=2e-3)
    # By the zero of D instead of the barrier it sits a third of a cell right of the defect.
    j = np.flatnonzero((v[:-1] > 0.0) & (v[1:] <= 0.0))[0]
    zero = j + 1 + v[j] / (v[j] - v[j + 1])
    assert zero == pytest.approx(CASE_II.defect_site(level) + 0.33, abs=0.01)
    chain = Chain(CASE_II)
    chain.place(v)
    chain.advance_steps(4000)  # 1000 time units
    np.testing.assert_allclose(chain.v, v, atol=1e-11)


def test_wall_of_a_symmetric_law_is_not_balanced_on_its_defect():
    """A guess on the defect itself leads to the top between two cells, which is unstable."""
    law = sample_force(lambda D: 4.0 * D * (D * D - 1.0), -1.8, 1.8, 41)
    design = dataclasses.replace(CASE_II, law=law, d=0.3, gamma=0.0)
    with pytest.raises(StateError):
        relax_to_equilibrium(design, wall_profile(design, 100.0), np.zeros(design.N))
    (wall,) = find_walls(design, find_pinned_wall(design, 3))
    assert wall.position == pytest.approx(100.0, abs=1.0)


@pytest.mark.parametrize(
    ('changes', 'message'),
    [
        ({'beta': 0.0, 'gamma': -4e-3}, 'at its defect, j = 100, none remains'),
        ({'beta': 0.5}, 'at its defect, j = 100, one at 86 remains'),
    ],
    ids=['a slope without defects', 'hard defects'],
)
def test_design_without_pinning_is_reported(changes, message):
    with pytest.raises(StateError, match=message):
        find_pinned_wall(Specimen(dataclasses.replace(CASE_I, **changes)), 0)


@pytest.mark.parametrize('strain', [0.0, -0.012, 0.012])
def test_held_wall_is_where_it_is_held_and_all_else_is_relaxed(strain):
    V = CASE_I.end_displacement(strain) * oracle.quasi_static(CASE_I)
    X = np.array([40.0, 81.3, 99.5, 100.0, 150.75])
    held = hold_walls(CASE_I, X, V)
    for position, v, force in zip(X, held.v, held.force, strict=True):
        (wall,) = find_walls(CASE_I, v - V)
        assert wall.position == pytest.approx(position, abs=1e-9)
        residual = oracle.forces(CASE_I, v, V)[0]
        left = int(position) - 1
        residual[left] -= force * (1.0 - position % 1.0)
        residual[left + 1] -= force * (position % 1.0)
        assert np.abs(residual).max() < 1e-10


def test_tridiagonal_solver_detects_indefinite_matrix():
    """The least eigenvalue of n springs is 2 - 2 cos(pi / (n + 1)); a shift passes it."""
    n = 10
    least = 2.0 - 2.0 * np.cos(np.pi / (n + 1))
    for shift, definite in ((0.99 * least, True), (1.01 * least, False)):
        found = solve_tridiagonal(np.full(n, 2.0 - shift), -np.ones(n - 1), np.ones((1, n)))
        assert found is definite
