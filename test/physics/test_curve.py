# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Laws other than the paper's, against closed forms.

phi-4, psi = h (1 - D^2)^2: a wall is tanh(kappa x) with kappa = sqrt(2 h) in the continuum. It has
the energy 4 kappa / 3, waves of the band edge omega_0^2 = 8 h, and one internal mode, of
sqrt(3)/2 omega_0 (Rajaraman, Solitons and Instantons, 1982, ch. 5).
Three and four ground states: a wall's energy is the integral of sqrt(2 psi).
The paper's potential, tabulated, is the paper's potential.
"""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from laws import on_site_force, sample_force
from suite import expect_rejection

from mlmem.physics import CASE_II, Chain, Design, DesignError, Potential
from mlmem.physics.curve import Curve
from mlmem.physics.equilibrium import relax_to_equilibrium, stiffness_diagonal, wall_profile
from mlmem.physics.held_wall import hold_walls

PHI_4 = sample_force(lambda D: 4.0 * D * (D * D - 1.0), -2.0, 2.0, 41)
PHI_6 = sample_force(lambda D: 2.0 * D * (1.0 - D**2) * (1.0 - 3.0 * D**2), -1.4, 1.4, 561)
"""psi = D^2 (1 - D^2)^2."""

PHI_8 = sample_force(
    lambda D: 4.0 * D * (D**2 - 1.0) * (D**2 - 4.0) * (2.0 * D**2 - 5.0), -2.4, 2.4, 961
)
"""psi = (D^2 - 1)^2 (D^2 - 4)^2."""

FLAT = (0.0,) * 8
"""As few forces as a curve may have; it may have 512 times as many."""


def uniform(law, d, phase=0, N=80):
    return Design(
        N=N, gamma=0.0, beta=0.0, J=20, J_s=40, j_0=17.0, d=d, law=law, phase=phase, eta=0.0
    )


def test_curve_repeats_cubic():
    """To the rounding of forces of 24 and stiffnesses of 44; beyond its ends it is straight."""
    D = np.linspace(-2.0, 2.0, 1_001)
    assert PHI_4.slope(D) == pytest.approx(4.0 * D * (D * D - 1.0), abs=1e-13)
    assert PHI_4.stiffness(D) == pytest.approx(12.0 * D * D - 4.0, abs=1e-12)
    assert PHI_4.energy(D) == pytest.approx((1.0 - D * D) ** 2, abs=1e-13)
    assert PHI_4.slope([-3.0, 3.0]) == pytest.approx([-68.0, 68.0], abs=1e-11)
    assert PHI_4.max_stiffness(9.9) == pytest.approx(44.0)


def test_max_stiffness_is_found_between_two_forces():
    """Of D (1 - D^2) the stiffness is greatest at 0, in the middle of an interval."""
    law = sample_force(lambda D: D * (1.0 - D * D), -0.75, 0.75, 16)
    assert max(abs(float(law.stiffness(D))) for D in (-0.75, 0.75)) < 0.7
    assert law.max_stiffness(0.0) == pytest.approx(1.0, abs=1e-12)
    assert law.max_stiffness(0.0) > float(law.stiffness(0.05)) + 1e-3


@pytest.mark.parametrize('law', [PHI_4, PHI_6, PHI_8])
def test_forces_are_derivatives(law):
    D, h = np.linspace(law.low - 0.5, law.high + 0.5, 503), 1e-6
    scale = law.max_stiffness(0.0)
    slope = (law.energy(D + h) - law.energy(D - h)) / (2.0 * h)
    assert law.slope(D) == pytest.approx(slope, abs=1e-7 * scale)
    bend = (law.slope(D + h) - law.slope(D - h)) / (2.0 * h)
    assert law.stiffness(D) == pytest.approx(bend, abs=1e-4 * scale)


def test_force_of_loops_is_that_of_curve():
    D = np.linspace(-2.5, 2.5, 501)
    constants = PHI_4.constants(np.full(3, 0.3))
    force = on_site_force(constants, D - PHI_4.origin)
    assert force == pytest.approx(0.3 * PHI_4.slope(D), abs=1e-13)
    assert np.isnan(on_site_force(constants, np.array([math.nan]))).all()


@pytest.mark.parametrize(
    ('law', 'states', 'barriers'),
    [
        (PHI_4, [-1.0, 1.0], [0.0]),
        (PHI_6, [-1.0, 0.0, 1.0], [-math.sqrt(1 / 3), math.sqrt(1 / 3)]),
        (PHI_8, [-2.0, -1.0, 1.0, 2.0], [-math.sqrt(2.5), 0.0, math.sqrt(2.5)]),
    ],
)
def test_ground_states_and_barriers_are_those_of_law(law, states, barriers):
    """To the error of a spline, h^4 / 384 of the fourth derivative of the force."""
    assert law.ground_states == pytest.approx(states, abs=1e-7)
    assert [law.barrier(n) for n in range(len(barriers))] == pytest.approx(barriers, abs=1e-7)
    assert law.wells(0, 1) == pytest.approx((law.low, (*barriers, law.high)[1]), abs=1e-7)


@pytest.mark.parametrize(
    ('law', 'phase', 'energy'),
    [
        (PHI_4, 0, 4 / 3),
        (PHI_6, 0, 1 / 4),
        (PHI_6, 1, 1 / 4),
        (PHI_8, 0, 22 / 15),
        (PHI_8, 1, 76 / 15),
        (PHI_8, 2, 22 / 15),
    ],
)
def test_energy_of_wall_is_that_of_the_continuum(law, phase, energy):
    """Walls ten cells wide; what the lattice changes is of order 1 / width^2."""
    kappa = 0.1 / (math.sqrt(law.stiffness(law.ground_states[phase]) / 8.0))
    design = uniform(law, kappa**2 / 2.0, phase, 400)
    held = hold_walls(design, np.array([200.5]), np.zeros(design.N))
    assert held.energy[0] == pytest.approx(math.sqrt(2.0 * design.d) * energy, rel=0.01)


def test_internal_mode_of_phi_4_wall():
    """Translation, the internal mode, then the band; and the loop swings with its frequency."""
    kappa = 0.25
    design = uniform(PHI_4, kappa**2 / 2.0, N=160)
    edge = math.sqrt(8.0 * design.d)
    v = relax_to_equilibrium(design, wall_profile(design, 80.5), np.zeros(design.N))
    diagonal = stiffness_diagonal(design, v, np.zeros(design.N))
    matrix = np.diag(diagonal) - np.eye(design.N, k=1) - np.eye(design.N, k=-1)
    squares, modes = np.linalg.eigh(matrix)
    assert abs(squares[0]) < 1e-4 * edge**2
    assert math.sqrt(squares[1]) == pytest.approx(math.sqrt(0.75) * edge, rel=0.01)
    assert squares[2] > 0.999 * edge**2
    chain = Chain(design)
    chain.place(v + 1e-4 * modes[:, 1])
    period = 2.0 * math.pi / math.sqrt(squares[1])
    chain.advance_steps(round(0.5 * period / chain.dt))
    assert (chain.v - v) @ modes[:, 1] == pytest.approx(-1e-4, rel=0.02)


@pytest.mark.parametrize(('symbol', 'value'), [('phase', 1), ('a', 0.3)])
def test_law_that_makes_no_memory_is_rejected(symbol, value):
    """Two ground states make one pair, of phase 0; a law takes the place of a, b and c."""
    with pytest.raises(DesignError, match=f'{symbol} must be'):
        replace(uniform(PHI_4, 0.1), **{symbol: value})


@pytest.mark.parametrize(
    ('values', 'field'),
    [
        ((1.0, 0.0, FLAT), 'high'), ((1.0, 1.0, FLAT), 'high'), ((math.nan, 1.0, FLAT), 'low'),
        ((0.0, 1e7, FLAT), 'high'), ((0.0, 1.0, FLAT[1:]), 'force'),
        ((0.0, 1.0, FLAT * 512 + FLAT[:1]), 'force'), ((0.0, 1.0, (*FLAT, math.nan)), 'force'),
        ((0.0, 1.0, FLAT, 0.0), 'd'),
    ],
)  # fmt: skip
def test_curve_that_is_none_is_rejected(values, field):
    Curve(0.0, 1.0, FLAT)
    Curve(0.0, 1.0, FLAT * 512)
    with expect_rejection(DesignError, 'out_of_range', field):
        Curve(*values)


def double_well(D):
    """Ground states at -1 and 1, a barrier of 1 at 0."""
    return (D**2 - 1.0) ** 2


def test_potential_of_function_has_its_slope_and_ground_states():
    """The function is called only within its range: beyond 1.8 it is no number."""

    def law(D):
        return np.where(np.abs(D) <= 1.8, double_well(D), np.nan)

    own = Potential.from_function(law, -1.8, 1.8)
    assert own.ground_states == pytest.approx([-1.0, 1.0], abs=1e-9)
    assert own.barrier(0) == pytest.approx(0.0, abs=1e-9)
    D = np.linspace(-1.8, 1.8, 777)
    # A quartic through five points is exact; the spline between them is of third order.
    assert own.slope(D) == pytest.approx(4.0 * D * (D * D - 1.0), abs=1e-9)
    assert own.energy(D) == pytest.approx(double_well(D), abs=1e-9)
    assert own.stiffness(1.0) == pytest.approx(8.0, abs=1e-6)


def test_potential_of_function_of_a_number_is_that_of_arrays():
    scalar = Potential.from_function(lambda D: math.cos(D) if D < 4.0 else math.cos(4.0), 0.0, 9.0)
    array = Potential.from_function(lambda D: np.cos(np.minimum(D, 4.0)), 0.0, 9.0)
    assert scalar.force == pytest.approx(array.force, abs=1e-12)


@pytest.mark.parametrize('law', [double_well, 'law.csv', CASE_II.potential])
def test_design_with_another_law_than_a_curve_is_rejected(law):
    with expect_rejection(DesignError, 'out_of_range', 'law'):
        replace(CASE_II, law=law)


def test_copy_of_design_with_law_takes_phase_of_that_law():
    own = Potential.from_function(double_well, -1.8, 1.8)
    copy = replace(CASE_II, law=own, d=0.03)
    assert copy.phase == 0
    assert (replace(copy, N=250).phase, replace(copy, law=None).phase) == (0, 1)
    assert replace(copy, law=None) == replace(CASE_II, d=0.03)
    assert json.dumps(copy.as_dict()['phase']) == '0'
    for chosen in (replace(CASE_II, phase=1), replace(CASE_II, phase=2)):
        with expect_rejection(DesignError, 'conflict', 'phase'):
            replace(chosen, law=own)
