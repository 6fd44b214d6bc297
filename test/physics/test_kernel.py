# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The scalar formulas of the loops, against libm and against the paper's potential."""

import math

import numpy as np
import oracle
import pytest

from mlmem_ros.physics import CASE_II
from mlmem_ros.physics.kernel import on_site, sine


@pytest.mark.parametrize(
    ('reach', 'tolerance'),
    [
        (math.pi / 2, 5e-16),  # the polynomial alone: its roundings
        (20.0, 1e-15),  # the angles of ground states 1 to 3
        (640.0, 1e-13),  # ground state 100, the largest that a design may use
    ],
)
def test_the_sine(reach, tolerance):
    angles = np.linspace(-reach, reach, 20_001)
    error = [sine(float(theta)) - math.sin(theta) for theta in angles]
    assert np.abs(error).max() < tolerance


@pytest.mark.parametrize('half_turns', range(-5, 6))
def test_the_sine_on_both_sides_of_every_fold(half_turns):
    """Where the reduction changes its half turn, (n + 1/2) pi, and where it vanishes, n pi."""
    for theta in (half_turns * math.pi, (half_turns + 0.5) * math.pi):
        for nearby in (math.nextafter(theta, -100), theta, math.nextafter(theta, 100)):
            assert sine(nearby) == pytest.approx(math.sin(nearby), abs=1e-15)


def test_the_sine_keeps_a_nan():
    assert math.isnan(sine(math.nan))
    assert math.isnan(sine(math.inf))


def test_the_on_site_force_is_the_papers():
    """Over twice the way between the phases: this is where a chain can be."""
    D = np.linspace(-3.0, 3.0, 10_001)
    p = CASE_II
    exact = oracle.psi_prime(p, D)
    force = p.d * np.array([on_site(float(x), p.a, p.b, p.c) for x in D])
    # An angle of 20 is known to 4e-15, and its sine multiplies a slope of at most 6.
    np.testing.assert_allclose(force, exact, rtol=0, atol=1e-13 * np.abs(exact).max())
