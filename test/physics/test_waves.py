# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Small waves: Eq. (4) against the printed bands, and transfer matrices.

====================  ==============================================================
quantity              must agree with
====================  ==============================================================
bands of Case II      0.4689 - 2.0542 (s1), 0.7688 - 2.1427 (s2)
wavenumber            the roots of the quadratic Eq. (4) in the propagation constant
group velocity        d omega / d kappa
transfer matrices     the sum of modes; a step of the integrator
====================  ==============================================================
"""

import math

import numpy as np
import pytest

from mlmem.physics import CASE_II, Design, Specimen
from mlmem.physics import waves as eq4
from mlmem.physics.equilibrium import make_blank
from mlmem.physics.pefrl import step_matrix
from mlmem.physics.waves import Tones, combine_rows, linearize_cells, multiply_matrices

PHASES = pytest.mark.parametrize('k_s', [CASE_II.k_s1, CASE_II.k_s2], ids=['s1', 's2'])


def test_bands_of_case_ii_are_those_printed():
    assert eq4.pass_band(CASE_II.k_s1) == pytest.approx((0.4689, 2.0542), abs=5e-5)
    assert eq4.pass_band(CASE_II.k_s2) == pytest.approx((0.7688, 2.1427), abs=5e-5)


@PHASES
def test_wavenumber_solves_eq_4(k_s):
    for omega in np.linspace(0.05, 3.0, 60):  # below, inside and above the band
        theta = np.roots([1.0, -(2.0 + k_s - omega**2), 1.0])[0]  # 2 + k - 1/theta - theta = w^2
        kappa = 1j * np.log(complex(theta))
        found = eq4.wavenumber(omega, k_s)
        # The roots meet at the band edges, where they know half the digits.
        assert found.real == pytest.approx(abs(kappa.real), abs=1e-7)
        assert found.imag == pytest.approx(abs(kappa.imag), abs=1e-7)


@PHASES
def test_group_velocity_is_slope_of_frequency(k_s):
    """That of Eq. (4); it is zero outside the band."""
    kappa, h = np.linspace(0.1, 3.0, 30), 1e-5
    before, omega, after = (np.sqrt(k_s + 2.0 - 2.0 * np.cos(kappa + d)) for d in (-h, 0.0, h))
    slope = (after - before) / (2.0 * h)
    np.testing.assert_allclose(eq4.group_velocity(omega, k_s), slope, atol=1e-9)  # h^2 and eps / h
    low, high = eq4.pass_band(k_s)
    np.testing.assert_array_equal(eq4.group_velocity([0.9 * low, 1.1 * high], k_s), 0.0)


MADE = Specimen(Design(N=24, gamma=0.0, beta=0.0, J=8, J_s=16, j_0=4.0, d=0.04))
OMEGA = np.array([0.4, 0.8, 1.3, 1.7, 2.0, 2.6]) - 0.004j


def test_ends_of_uniform_chain_are_sum_of_its_modes():
    """N masses between free ends have the modes cos(m pi (j - 1/2) / N); u / f is the sum over
    them. The step is so short that the method's error is below that of rounding.
    """
    tones = Tones.from_steps(MADE, OMEGA, 1e-3)
    whole = multiply_matrices(*linearize_cells(MADE, make_blank(MADE)), tones.square, tones.loss)
    p, q = combine_rows(whole[None], np.array([[0]]))[0]
    n, design = 24, MADE.design
    m = np.arange(n)[:, None]
    square = np.where(m == 0, 1.0, 2.0) / n * np.cos(0.5 * math.pi * m / n) ** 2
    found = design.k_s1 + 2.0 - 2.0 * np.cos(math.pi * m / n)
    each = square / (found - OMEGA**2 + 1j * design.eta * OMEGA)
    assert q / p == pytest.approx(each.sum(axis=0), rel=1e-6)
    assert 1.0 / p == pytest.approx(((-1.0) ** m * each).sum(axis=0), rel=1e-6)


def test_step_makes_waves_of_its_own_frequency():
    """With a stiffness as the tones have it, a step multiplies by exp(i omega dt) exactly."""
    tones = Tones.from_steps(MADE, OMEGA, 0.5)
    step = step_matrix(-tones.square - tones.loss, MADE.eta, 0.5)
    factors = np.linalg.eigvals(step)
    off = np.abs(factors - np.exp(0.5j * OMEGA)[:, None]).min(axis=1)
    assert off.max() < 1e-9
    assert np.abs(tones.square + OMEGA**2).max() < 1e-2  # of fourth order in omega dt = 1.3
