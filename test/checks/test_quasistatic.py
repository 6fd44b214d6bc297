# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Walls under slow strain: an excerpt against the whole element, and against closed forms."""

import dataclasses
import math

import numpy as np
import pytest

from mlmem.physics import CASE_II, Scatter, draw_specimen
from mlmem.physics.held_wall import hold_walls
from mlmem_tools.checks.excerpt import cut_excerpt
from mlmem_tools.checks.quasistatic import (
    compute_held_landscape,
    compute_self_energy,
    find_depinning_strain,
)


@pytest.mark.parametrize(('low', 'high'), [(30, 60), (110, 140), (190, 224)])
def test_excerpt_has_the_cells_of_the_element(low, high):
    made = draw_specimen(CASE_II, Scatter(alpha=0.01, k_r=0.01, s=0.01, mass=0.01, offset=0.01), 1)
    made = dataclasses.replace(made, stuck=(low, high))
    part = cut_excerpt(made, low, high)
    cells = slice(part.before, part.before + part.design.N)
    assert part.before % CASE_II.J == 0  # the defects stay where they are
    assert part.before < low
    assert part.design.N < CASE_II.N
    amplitude = made.alpha[cells] * CASE_II.d
    assert part.made.alpha * part.design.d == pytest.approx(amplitude, rel=1e-13)
    for springs in ('k_r', 's'):  # between the cells
        own, whole = getattr(part.made, springs), getattr(made, springs)
        assert own == pytest.approx(whole[cells][: part.design.N - 1], rel=1e-13)
    for values in ('masses', 'offsets'):
        assert (getattr(part.made, values) == getattr(made, values)[cells]).all()
    assert part.made.stuck == (low - part.before, high - part.before)


@pytest.mark.parametrize('X', [40.0, 140.0, 200.0])
def test_wall_in_an_excerpt_is_that_of_the_element(X):
    """The error is exp(-DECAY) = 6e-6 of the strain's effect on a free edge."""
    part = compute_held_landscape(CASE_II, X, X + 8.0, strain=0.02)
    V = CASE_II.end_displacement(0.02) * CASE_II.strain_shape
    whole = hold_walls(CASE_II, part.X, V).energy
    assert np.ptp(whole) > 4e-3
    assert part.energy == pytest.approx(whole - whole[0], abs=2e-7)


@pytest.mark.parametrize(
    ('level', 'sign', 'kink', 'expected'),
    [
        (0, -1, False, -0.0204),  # the device makes this step from -0.021 on
        (1, +1, False, +0.0355),  # from +0.036 on
        (0, +1, True, +0.0150),  # the kink of an erase: from +0.016 on
        (1, -1, True, -0.0310),  # from -0.032 on
    ],
)
def test_strains_that_free_a_wall(level, sign, kink, expected):
    found = find_depinning_strain(CASE_II, level, sign, 0.1, kink=kink, tolerance=1e-4)
    assert found == pytest.approx(expected, abs=3e-4)


def test_no_strain_frees_a_wall_from_a_very_soft_defect():
    deep = dataclasses.replace(CASE_II, beta=-0.6)
    assert math.isnan(find_depinning_strain(deep, 0, -1.0, 0.04))


def test_gain_of_a_wall_is_half_its_energy_over_s():
    """In a uniform substrate: the springs hold half the wall's energy, sum v'^2 = E."""
    even = dataclasses.replace(CASE_II, s_min=500.0, s_max=500.0)
    _, gain = compute_self_energy(even)
    flat = dataclasses.replace(even, gamma=0.0, beta=0.0)
    (total,) = hold_walls(flat, np.array([112.5]), np.zeros(flat.N)).energy
    assert np.ptp(gain) < 1e-12
    assert gain[0] == pytest.approx(-0.5 * total / 500.0, rel=0.02)  # lattice against continuum
