# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The on-site potential.

====================  ==============================================================
quantity              must agree with
====================  ==============================================================
ground states, k_s    the paper's Table I worked out (five decimals)
energy                the formula of page 3, written again in `oracle.psi`
slope                 complex-step derivative of that formula
stiffness             second derivative of that formula by mpmath, 30 digits
ground_state(n)       the phase a y + b y^3 = 2 pi n, on the branch where it rises
barrier(n)            a maximum of height 2 d between ground states n and n + 1
b -> 0                the straight phase: ground states 2 pi n / a apart
force of the loops    the formula's derivative; its sine: libm, mpmath at every fold
====================  ==============================================================
"""

import math

import mpmath
import numpy as np
import oracle
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from laws import on_site_force

from mlmem.physics import CASE_II, DesignError
from mlmem.physics.formulas import exponential, sine_of_turns
from mlmem.physics.potential import Potential

TABLE_I = Potential(a=0.2582, b=0.0172, c=7.4489, d=0.0380)


@pytest.mark.parametrize(
    ('n', 'configuration', 'k_over_d'), [(1, -0.99790, 5.7867), (2, 1.00286, 15.5560)]
)
def test_ground_states_are_those_of_the_paper(n, configuration, k_over_d):
    state = TABLE_I.ground_state(n)
    assert state == pytest.approx(configuration, abs=5e-6)  # half the last digit given
    assert TABLE_I.stiffness(state) / TABLE_I.d == pytest.approx(k_over_d, abs=5e-5)


def test_energy_and_slope_are_those_of_the_paper():
    D = np.linspace(-15.0, 4.0, 1001)  # ground states -3 to 4
    # Two roundings of an angle of at most 30.
    np.testing.assert_allclose(TABLE_I.energy(D), oracle.psi(TABLE_I, D), atol=1e-14 * TABLE_I.d)
    exact = oracle.psi_prime(TABLE_I, D)
    np.testing.assert_allclose(TABLE_I.slope(D), exact, atol=1e-13 * np.abs(exact).max())


@pytest.mark.parametrize('D', [-8.0, -1.0, -0.3, 0.1, 1.0, 2.5])
def test_stiffness_is_second_derivative_of_energy(D):
    p = TABLE_I
    with mpmath.workdps(30):
        exact = mpmath.diff(
            lambda x: p.d * (1 - mpmath.cos(p.a * (x + p.c) + p.b * (x + p.c) ** 3)), D, 2
        )
    assert TABLE_I.stiffness(D) == pytest.approx(float(exact), abs=1e-13)


once = settings(deadline=None, derandomize=True, database=None)


def phase(a, b, y):
    """Return the phase at y, the sizes of its terms summed (what it is rounded by), its slope."""
    return a * y + b * y**3, a * abs(y) + abs(b * y**3), a + 3.0 * b * y * y


@given(
    a=st.floats(1e-3, 1e2),
    b=st.one_of(st.just(0.0), st.floats(1e-12, 10.0), st.floats(-10.0, -1e-12)),
    half_turns=st.integers(-40, 40),
)
@settings(once, max_examples=220)
def test_states_and_barriers_have_phases_of_half_turns(a, b, half_turns):
    """On the rising branch; refused are those which it does not reach."""
    potential, theta = Potential(a, b, c=0.0, d=1.0), math.pi * half_turns
    try:
        y = (potential.barrier if half_turns % 2 else potential.ground_state)(half_turns // 2)
    except DesignError:
        assert b < 0.0
        top = -math.sqrt(a / (-3.0 * b)) if theta < 0.0 else math.sqrt(a / (-3.0 * b))
        assert abs(phase(a, b, top)[0]) <= abs(theta) * (1.0 + 1e-14)
        return
    reached, size, rising = phase(a, b, y)
    assert reached == pytest.approx(theta, abs=4e-15 * size)
    assert rising > -1e-7 * a  # zero at the turning point, to the root of the rounding


@given(a=st.floats(1e-2, 10.0), b=st.floats(-1e-3, 10.0), c=st.floats(-50.0, 50.0))
@settings(once, max_examples=70)
def test_between_two_ground_states_stands_barrier_of_2_d(a, b, c):
    potential = Potential(a, b, c, d=0.7)
    try:
        low, top, high = potential.ground_state(1), potential.barrier(1), potential.ground_state(2)
    except DesignError:
        return
    assert low < top < high
    steepest = max(abs(a), abs(phase(a, b, high + c)[2]))
    rounding = 1e-14 * (1.0 + abs(c) * steepest)  # of the phase, through D + c
    assert potential.energy([low, high]) == pytest.approx([0.0, 0.0], abs=rounding**2)
    assert potential.energy(top) == pytest.approx(1.4, abs=1e-14 + rounding**2)
    assert potential.stiffness(top) < 0.0 < potential.stiffness(low)


@pytest.mark.parametrize('b', [1e-320, -1e-320, 1e-200, 1e-12, -1e-12])
def test_vanishing_cubic_term_changes_nothing(b):
    # Cardano's a / b overflows here; y^3 b is below 2e-9 of the phase.
    assert Potential(0.5, b, 0.0, 1.0).ground_state(1) == pytest.approx(4 * math.pi, rel=1e-9)


def test_phase_that_turns_back_has_finitely_many_states():
    """Its outermost wells end where it turns."""
    # theta = y - b y^3 tops out at 2/3 y_turn with y_turn = sqrt(1 / 3b): b = 1e-3 gives 12.17,
    # short of 4 pi.
    turning, turn = Potential(a=1.0, b=-1e-3, c=2.0, d=1.0), math.sqrt(1e3 / 3.0)
    assert turning.ground_state(1) < turning.barrier(1) < turn - 2.0
    with pytest.raises(DesignError, match=r'no ground state 2: .* 12\.17.* 12\.57.*; got -0\.001'):
        turning.ground_state(2)
    with pytest.raises(DesignError, match='no barrier above ground state 2'):
        turning.barrier(2)
    assert turning.wells(1, 1) == (turning.barrier(0), turning.barrier(1))
    assert turning.wells(1, 2)[1] == pytest.approx(turn - 2.0)
    assert turning.wells(-2, 1)[0] == pytest.approx(-turn - 2.0)


@given(a=st.floats(1e-2, 10.0), b=st.floats(-1.0, 10.0), c=st.floats(-50.0, 50.0))
@settings(once, max_examples=100)
def test_no_configuration_within_reach_is_stiffer_than_bound(a, b, c):
    potential = Potential(a, b, c, d=0.7)
    for reach in (0.1, 3.0, 20.0):
        D = np.linspace(-reach, reach, 2001) - c
        largest = np.abs(potential.stiffness(D)).max()
        assert largest <= potential.max_stiffness(reach) * (1.0 + 1e-9)


FOLDS = 0.25 * np.arange(-10, 11)
"""Zeros and crests of the sine, where the reduction changes its turn or its branch."""


@pytest.mark.parametrize(
    ('angles', 'tolerance'),
    [
        (np.linspace(-0.25, 0.25, 1_001), 1e-15),  # the polynomial alone: its roundings
        (np.linspace(-3.2, 3.2, 1_001), 3e-15),  # ground states 1 to 3
        (np.linspace(-102.0, 102.0, 1_001), 1e-13),  # state 100, the largest of a design
        (np.nextafter(FOLDS, [[-100.0], [100.0]]).ravel(), 3e-15),
        (FOLDS, 3e-15),
    ],
)
def test_sine_of_turns_is_exact_within_its_tolerance(angles, tolerance):
    for turns in angles.tolist():
        with mpmath.workdps(40):  # of exactly this double
            exact = float(mpmath.sinpi(2 * mpmath.mpf(turns)))
        assert sine_of_turns(turns) == pytest.approx(exact, abs=tolerance)
    assert np.isnan([sine_of_turns(math.nan), sine_of_turns(math.inf)]).all()


def test_on_site_force_is_that_of_the_paper():
    """Over twice the way between the phases: this is where a chain can be."""
    D = np.linspace(-3.0, 3.0, 10_001)
    p = CASE_II
    exact = oracle.psi_prime(p, D)
    constants = np.full(2, p.d), p.a, p.b
    force = on_site_force(constants, D + p.c)
    # An angle of 20 is known to 4e-15, and its sine multiplies a slope of at most 6.
    np.testing.assert_allclose(force, exact, rtol=0, atol=1e-13 * np.abs(exact).max())


def test_exponential_agrees_within_range_of_numbers():
    """Its decay ends at zero, however far out."""
    x = np.linspace(-700.0, 700.0, 2001)
    np.testing.assert_allclose(exponential(x), np.exp(x), rtol=3e-13)
    with np.errstate(all='raise', under='ignore'):
        far = exponential(-np.array([746.0, 1e4, 1e19, 1e60, 1e300, np.inf]))
    assert (far == 0.0).all()
