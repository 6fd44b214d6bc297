# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Small waves by transfer matrices, beside closed forms."""

import math

import numpy as np
import pytest

from mlmem.physics import PEFRL, Design, Specimen
from mlmem.physics.equilibrium import make_blank
from mlmem.physics.waves import Tones, combine_rows, linearize_cells, multiply_matrices

MADE = Specimen(Design(N=24, gamma=0.0, beta=0.0, J=8, J_s=16, j_0=4.0, d=0.04))
OMEGA = np.array([0.4, 0.8, 1.3, 1.7, 2.0, 2.6]) - 0.004j


def test_ends_of_uniform_chain_are_sum_of_its_modes():
    """N masses between free ends have the modes cos(m pi (j - 1/2) / N); u / f is the sum over
    them. The step is so short that the method's error is below that of rounding.
    """
    tones = Tones.of(MADE, OMEGA, PEFRL, 1e-3)
    whole = multiply_matrices(*linearize_cells(MADE, make_blank(MADE)), tones.square, tones.loss)
    p, q = combine_rows(whole[None], np.array([[0]]))[0]
    n, design = 24, MADE.design
    m = np.arange(n)[:, None]
    square = np.where(m == 0, 1.0, 2.0) / n * np.cos(0.5 * math.pi * m / n) ** 2
    found = design.k_s1 + 2.0 - 2.0 * np.cos(math.pi * m / n)
    each = square / (found - OMEGA**2 + 1j * design.eta * OMEGA)
    assert q / p == pytest.approx(each.sum(axis=0), rel=1e-6)
    assert 1.0 / p == pytest.approx(((-1.0) ** m * each).sum(axis=0), rel=1e-6)


def test_parts_of_element_are_multiplied():
    """A chain cut anywhere is the product of its parts, and every matrix has determinant 1, which
    rounding shows inside the band.
    """
    tones = Tones.of(MADE, OMEGA[1:5], PEFRL, 0.5)
    stiffness, mass, spring = linearize_cells(MADE, make_blank(MADE))
    parts = np.array(
        [
            multiply_matrices(stiffness[part], mass[part], spring[part], tones.square, tones.loss)
            for part in (slice(0, 24), slice(0, 7), slice(7, 24))
        ]
    )
    assert np.linalg.det(parts) == pytest.approx(np.ones((3, 4)), rel=1e-9)
    whole = combine_rows(parts[:1], np.array([[0]]))
    assert combine_rows(parts[1:], np.array([[0, 1]])) == pytest.approx(whole, rel=1e-9)


def test_step_makes_waves_of_its_own_frequency():
    """With a stiffness as the tones have it, a step multiplies by exp(i omega dt) exactly."""
    tones = Tones.of(MADE, OMEGA, PEFRL, 0.5)
    step = PEFRL.step_matrix(-tones.square - tones.loss, MADE.eta, 0.5)
    factors = np.linalg.eigvals(step)
    off = np.abs(factors - np.exp(0.5j * OMEGA)[:, None]).min(axis=1)
    assert off.max() < 1e-9
    assert np.abs(tones.square + OMEGA**2).max() < 1e-2  # of fourth order in omega dt = 1.3
