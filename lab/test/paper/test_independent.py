# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The second route itself, and the table of differences.

=====================  =============================================================
second route           must agree with
=====================  =============================================================
its modules            it imports no potential, force, substrate or integrator of ours
psi', psi''            the material's closed forms
total_energy           the gradient, by a difference along a random direction
equation_1a + DOP853   an undamped cell in a harmonic well: a cosine
kink_profile           v' = -sqrt(2 psi), by a difference
the table              small differences, each of the size that its method allows
=====================  =============================================================
"""

import ast
import dataclasses
import inspect
import math

import numpy as np
import pytest

from mlmem.physics import CASE_I, CASE_II
from mlmem_lab.paper import equations as other

SMALL = dataclasses.replace(CASE_II, N=40)


def test_it_shares_no_code_with_the_material():
    tree = ast.parse(inspect.getsource(other))
    imported = {
        f'{node.module}.{name.name}'
        for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)
        for name in node.names if node.level or node.module.startswith('mlmem')
    }  # fmt: skip
    assert imported == {'mlmem.physics.design.Design', 'mlmem.physics.potential.Array'}
    calls = {node.attr for node in ast.walk(tree) if isinstance(node, ast.Attribute)}
    assert not calls & {'potential', 'alpha', 's', 'strain_shape', 'D_s1', 'D_s2', 'k_s1', 'k_s2'}


def test_the_potential_is_that_of_the_material():
    D = np.linspace(-2.0, 2.0, 101)
    potential = CASE_II.potential
    np.testing.assert_allclose(
        other.on_site_potential(CASE_II, D), potential.energy(D), atol=1e-15
    )
    np.testing.assert_allclose(other.psi_prime(CASE_II, D), potential.slope(D), atol=1e-14)
    np.testing.assert_allclose(other.psi_second(CASE_II, D), potential.stiffness(D), atol=1e-8)
    np.testing.assert_allclose(other.ground_states(CASE_II), [CASE_II.D_s1, CASE_II.D_s2],
                               atol=1e-7)  # fmt: skip


def test_the_element_is_that_of_the_design():
    np.testing.assert_allclose(other.site_strength(CASE_II), CASE_II.alpha, rtol=1e-15)
    np.testing.assert_allclose(other.substrate_shape(CASE_II), CASE_II.strain_shape, atol=1e-13)


def test_the_gradient_is_that_of_the_energy():
    rng = np.random.default_rng(3)
    v, V, way = rng.normal(size=(3, 40))
    h = 1e-6
    slope = other.total_energy(SMALL, v + h * way, V) - other.total_energy(SMALL, v - h * way, V)
    assert slope / (2 * h) == pytest.approx(other.energy_gradient(SMALL, v, V) @ way, rel=1e-7)


def test_the_integrator_swings_a_uniform_chain_as_one_cell():
    free = dataclasses.replace(SMALL, gamma=0.0, beta=0.0, eta=0.0)
    D, amplitude, t = other.ground_states(free)[0], 1e-4, 30.0
    start = np.concatenate((np.full(40, D + amplitude), np.zeros(40)))
    end = other.integrate_rates(other.equation_1a(free, lambda _: 0.0), start, (0.0, t))
    omega = np.sqrt(float(other.psi_second(free, np.array(D))))
    np.testing.assert_allclose(end[:40] - D, amplitude * np.cos(omega * t), atol=1e-7)


@pytest.mark.parametrize('design', [CASE_I, CASE_II], ids=['case_1', 'case_2'])
def test_the_continuum_wall_obeys_its_equation_and_holds_its_energy(design):
    x = np.linspace(-40.0, 40.0, 4001)
    v = other.kink_profile(design, x)
    slope = np.gradient(v, x)
    np.testing.assert_allclose(
        slope[1:-1], -np.sqrt(2.0 * other.on_site_potential(design, v[1:-1])), atol=3e-5
    )
    density = 0.5 * slope**2 + other.on_site_potential(design, v)
    assert np.trapezoid(density, x) == pytest.approx(other.kink_energy(design), rel=2e-4)
    assert -slope.min() == pytest.approx(2.0 * math.sqrt(design.d), rel=1e-4)


TOLERANCES = {
    'ground state': 1e-7, 'stiffness': 1e-7, 'substrate': 1e-12, 'band edge': 1e-7,
    'wall energy': 0.01, 'wall width': 0.05, 'barrier, Case II': 0.01, 'barrier, unrelaxed': 2.0,
    'kink ansatz': 1e-3, 'wall pinned': 1e-6, 'de-pinning': 0.01, 'wall at the end': 1e-4,
    'time at which': 1e-5, 'echo delay, wall': 0.01, 'greatest v_c of the echo': 0.2,
    'greatest v_c x 1e3, a tenth': 0.01, 'echo delay, a tenth': 1e-3, 'v_1 at t = 300': 0.02,
}  # fmt: skip
"""Largest relative difference by what a quantity's name contains."""


def test_both_routes_agree_in_every_quantity(small):
    table = small['check']
    assert len(table['quantity']) >= 20
    for name, ours, theirs in zip(table['quantity'], table['ours'], table['theirs'], strict=True):
        (limit,) = (value for key, value in TOLERANCES.items() if key in name)
        assert ours == pytest.approx(theirs, rel=limit), name


def test_the_histories_lie_on_each_other(small):
    table = small['check']
    np.testing.assert_allclose(table['wall_ours'], table['wall_theirs'], atol=0.02)
    assert np.ptp(table['wall_theirs']) > 15.0
