# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Walls held at a place, from whose energies landscapes are made.

=====================  =============================================================
hold_walls             must agree with
=====================  =============================================================
v                      the constraint; the paper's forces, but for the holding force
energy                 its slope by differences: the holding force
where it needs none    a free equilibrium, in a minimum
=====================  =============================================================

The ansatzes are judged by `test_claims.py`.
"""

import numpy as np
import oracle
import pytest

from mlmem.physics import CASE_I, CASE_II, find_walls
from mlmem.physics.equilibrium import find_pinned_wall
from mlmem.physics.held_wall import hold_walls


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
    held = hold_walls(CASE_I, np.array([X - h, X, X + h]), np.zeros(CASE_I.N))
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
