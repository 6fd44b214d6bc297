# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The scalar formulas of the loops, against libm and against the paper's potential."""

import math

import mpmath
import numpy as np
import oracle
import pytest
from laws import on_site_force

from mlmem.physics import CASE_II
from mlmem.physics.formulas import exponential, sine_of_turns


def exact(turns):
    """Return sin(2 pi turns) of exactly this double."""
    with mpmath.workdps(40):
        return float(mpmath.sinpi(2 * mpmath.mpf(turns)))


@pytest.mark.parametrize(
    ('reach', 'tolerance'),
    [
        (0.25, 1e-15),  # the polynomial alone: its roundings
        (3.2, 3e-15),  # the angles of ground states 1 to 3
        (102.0, 1e-13),  # ground state 100, the largest that a design may use
    ],
)
def test_sine_of_turns_is_exact_within_its_tolerance(reach, tolerance):
    angles = np.linspace(-reach, reach, 4_001)
    error = [sine_of_turns(float(turns)) - exact(float(turns)) for turns in angles]
    assert np.abs(error).max() < tolerance


@pytest.mark.parametrize('quarters', range(-10, 11))
def test_sine_is_exact_on_both_sides_of_every_fold(quarters):
    """At every zero and crest, where the reduction changes its turn or its branch."""
    turns = 0.25 * quarters
    for nearby in (math.nextafter(turns, -100), turns, math.nextafter(turns, 100)):
        assert sine_of_turns(nearby) == pytest.approx(exact(nearby), abs=3e-15)


def test_sine_keeps_nan():
    assert math.isnan(sine_of_turns(math.nan))
    assert math.isnan(sine_of_turns(math.inf))


def test_on_site_force_is_that_of_the_paper():
    """Over twice the way between the phases: this is where a chain can be."""
    D = np.linspace(-3.0, 3.0, 10_001)
    p = CASE_II
    exact = oracle.psi_prime(p, D)
    constants = np.full(2, p.d), p.a, p.b
    force = on_site_force(constants, D + p.c)
    # An angle of 20 is known to 4e-15, and its sine multiplies a slope of at most 6.
    np.testing.assert_allclose(force, exact, rtol=0, atol=1e-13 * np.abs(exact).max())


def test_decay_ends_at_zero_however_far_out():
    with np.errstate(all='raise', under='ignore'):
        far = exponential(-np.array([746.0, 1e4, 1e19, 1e60, 1e300, np.inf]))
    assert (far == 0.0).all()


def test_exponential_agrees_within_range_of_numbers():
    x = np.linspace(-700.0, 700.0, 2001)
    np.testing.assert_allclose(exponential(x), np.exp(x), rtol=3e-13)
