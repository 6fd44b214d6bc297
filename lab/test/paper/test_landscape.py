# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The energy landscape by ansatz and by held walls.

=====================  =============================================================
landscape              must agree with
=====================  =============================================================
kink and Fourier fits  their own slopes by differences; data made from the ansatz
landscape              the held wall's energy, element without strain and with it
hold_walls             the constraint; forces of the paper; dU/dX is the holding force;
                       free equilibria where that force vanishes
=====================  =============================================================
"""

import numpy as np
import oracle
import pytest

from mlmem.physics import CASE_I, CASE_II, find_walls
from mlmem.physics.equilibrium import find_pinned_wall
from mlmem.physics.held_wall import hold_walls, make_uniform
from mlmem_lab.paper.landscapes import (
    MAX_FIT_ERROR,
    compute_landscape,
    fit_displacement,
    fit_kink,
    strained_equilibrium,
)

ZERO = np.zeros(CASE_I.N)


@pytest.fixture(scope='module')
def kink():
    return fit_kink(CASE_I)


# --- held walls -------------------------------------------------------------------------------


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


def test_slope_of_the_landscape_is_the_holding_force():
    """The constraint moves with X at the local slope of the profile: dU/dX = -force x slope."""
    h = 1e-4
    X = 90.4
    held = hold_walls(CASE_I, np.array([X - h, X, X + h]), ZERO)
    slope = float(held.energy[2] - held.energy[0]) / (2 * h)
    drop = held.v[1][90] - held.v[1][89]
    assert slope == pytest.approx(float(held.force[1]) * drop, rel=1e-3)


def test_free_equilibrium_needs_no_force_and_lies_in_a_minimum():
    v = find_pinned_wall(CASE_II, 3)
    (wall,) = find_walls(CASE_II, v)
    X = wall.position + np.array([-0.3, 0.0, 0.3])
    held = hold_walls(CASE_II, X, np.zeros(CASE_II.N))
    assert abs(held.force[1]) < 1e-9
    np.testing.assert_allclose(held.v[1], v, atol=1e-8)
    assert held.energy[1] < min(held.energy[0], held.energy[2])


# --- the ansatzes -----------------------------------------------------------------------------


def test_kink_fit_is_close_and_its_slope_is_its_derivative(kink):
    flat = make_uniform(CASE_I)
    assert (flat.gamma, flat.beta) == (0.0, 0.0)
    (v,) = hold_walls(flat, np.array([100.5]), ZERO).v
    residual = kink.displacement(flat.sites - 100.5) - (v - flat.D_s1)
    assert np.sqrt(np.mean(residual**2)) == pytest.approx(kink.e_rms, rel=0.01)
    assert MAX_FIT_ERROR < kink.e_rms < 2e-3
    x = np.linspace(-40.0, 40.0, 17)
    h = 1e-6
    by_difference = (kink.displacement(x + h) - kink.displacement(x - h)) / (2 * h)
    np.testing.assert_allclose(kink.slope(x), by_difference, atol=1e-9)
    ends = kink.displacement(np.array([-300.0, 300.0]))
    np.testing.assert_allclose(ends, [np.pi / 2 * kink.A, 0.0], atol=1e-9)


@pytest.mark.parametrize('strain', [-0.009, 0.009])
def test_strained_element_is_at_equilibrium_and_fitted(strain):
    v, V = strained_equilibrium(CASE_I, strain)
    assert V[-1] == pytest.approx(strain * CASE_I.N)
    assert np.abs(oracle.forces(CASE_I, v, V)[0]).max() < 1e-11
    for displacement in (v, V):
        fit = fit_displacement(CASE_I, displacement)
        residual = fit.displacement(CASE_I.sites) - displacement
        assert np.sqrt(np.mean(residual**2)) == pytest.approx(fit.e_rms, rel=1e-6)
        assert fit.e_rms < MAX_FIT_ERROR


@pytest.mark.parametrize('strain', [0.0, -0.009, 0.009])
def test_ansatz_and_the_held_wall_give_one_landscape(strain, kink):
    v, V = strained_equilibrium(CASE_I, strain)
    X = np.array([40.0, 81.0, 95.0, 100.0, 105.0, 160.0])
    fits = fit_displacement(CASE_I, v), fit_displacement(CASE_I, V)
    U = compute_landscape(CASE_I, X, kink, *fits)
    held = hold_walls(CASE_I, X, V).energy
    assert np.ptp(U - held) < 3e-4
    assert np.ptp(held) > 3e-3
    if strain:
        printed = compute_landscape(CASE_I, X, kink, *fits, as_printed=True)
        assert np.ptp(printed - held) > 4.0 * np.ptp(U - held)
