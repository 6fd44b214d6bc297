# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The forward model: its derivatives by every cell and spring are those of its motion."""

import dataclasses
from functools import cache

import numpy as np
import pytest
from laws import sample_force

from mlmem.instrument.end import End, Shot
from mlmem.physics import CASE_II, Scatter, draw_specimen
from mlmem_tools.identification.forward import Forward
from mlmem_tools.identification.unknowns import CELL_TERMS, Unknowns, stretch_law

SMALL = dataclasses.replace(CASE_II, N=60)
SHOT = Shot(
    End.RIGHT, 1.2, 0.01, 3.0, SMALL.defect_site(0), 0.002, 0.3, np.zeros(2), np.zeros((2, 400))
)


OF_A_LAW = dataclasses.replace(
    SMALL, d=0.5, phase=1,
    law=sample_force(lambda D: 2.0 * SMALL.potential.slope(D), -8.0, 3.0, 256),
)  # fmt: skip
"""The paper's law as a curve, of twice the energy and half the factor."""


MADE = draw_specimen(SMALL, Scatter(alpha=0.01, k_r=0.02, mass=0.01, offset=0.002), 3)


def element():
    """Return the model of a scattered element in which everything is unknown."""
    unknowns = Unknowns(SMALL, frozenset({*CELL_TERMS, 'latency'}))
    x = unknowns.mean
    uneven = 1.0 + 0.2 * np.random.default_rng(3).standard_normal(SMALL.N)
    x[unknowns.alpha] = MADE.alpha
    cells = MADE.masses, MADE.offsets, MADE.k_r, uneven
    for term, values in zip(CELL_TERMS, cells, strict=True):
        x[unknowns.cells[term]] = values
    x[unknowns.shared('late_left')] = 0.17
    return Forward(unknowns, x)


def test_vector_describes_its_element():
    model = element()
    for name in ('alpha', 'k_r', 'masses', 'offsets'):
        found = getattr(model.specimen, name)
        np.testing.assert_allclose(found, getattr(MADE, name), rtol=1e-15, err_msg=name)


def assert_difference_quotient(model, J, at, error=2e-3):
    """Compare the derivatives by an unknown with central differences; the run is single precision,
    and short steps barely damp.
    """
    h = 1e-5 * np.eye(len(model.x))[at]
    sides = model.x + h, model.x - h
    up, down = (Forward(model.unknowns, x).predict(SHOT, 120.0) for x in sides)
    quotient = (up - down) / 2e-5
    scale = np.abs(quotient).max()
    assert scale > 1e-7
    np.testing.assert_allclose(J[:, :, at], quotient, atol=error * scale, err_msg=f'{at}')


@cache
def derivatives():
    """Return those by all that is unknown."""
    return element().linearise_shot(SHOT, 120.0)


@pytest.mark.parametrize(
    ('what', 'sites'), [('alpha', (0, 25, 59)), ('masses', (0, 25, 59)), ('offsets', (2, 25)),
                        ('springs', (0, 24, 25, 26, 58)), ('damping', (1, 25, 58))],
)  # fmt: skip
def test_derivatives_are_difference_quotients(what, sites):
    model = element()
    first = {'alpha': model.unknowns.alpha, **model.unknowns.cells}[what].start
    for site in sites:
        assert_difference_quotient(model, derivatives(), first + site)


def test_derivatives_by_patterns_are_sums_of_those_by_cells():
    """To single precision, which is that of a sum over 60 cells."""
    model, patterns = element(), np.stack((np.ones(SMALL.N), SMALL.sites / SMALL.N))
    every, few = derivatives(), model.linearise_shot(SHOT, 120.0, patterns)
    shared = slice(SMALL.N, model.unknowns.shared_end)
    summed = every[..., model.unknowns.alpha] @ patterns.T
    for found, expected in ((few[..., :2], summed), (few[..., 2:], every[..., shared])):
        scale = np.abs(expected).max(axis=(0, 1), keepdims=True)
        assert (np.abs(found - expected) <= 1e-3 * scale).all()


@pytest.mark.parametrize('design', [SMALL, OF_A_LAW])
def test_shared_derivatives_are_difference_quotients(design):
    """Of the paper's law, and of one of its own, which is stretched and skewed; by c two larger
    derivatives in single precision cancel.
    """
    unknowns = Unknowns(design)
    x = unknowns.mean
    x[unknowns.shared('D_s1')] -= 0.01
    x[unknowns.shared('D_s2')] += 0.02
    x[unknowns.shared('c')] += 0.03
    model = Forward(unknowns, x)
    J = model.linearise_shot(SHOT, 120.0)
    for name in ('D_s1', 'D_s2', 'c', 'eta', 'time_unit', 'j_0'):
        error = 5e-3 if name == 'c' else 2e-3
        assert_difference_quotient(model, J, unknowns.shared(name), error)


def test_stretched_law_has_its_ground_states_and_stiffness():
    """The second well over the first: (1 + skew / 2) / (1 - skew / 2)."""
    law, n = stretch_law(OF_A_LAW, -1.1, 1.2, 0.1), OF_A_LAW.phase
    assert law.ground_states[n : n + 2] == pytest.approx((-1.1, 1.2), abs=1e-6)
    ratio = law.stiffness(1.2) / law.stiffness(-1.1)
    assert ratio == pytest.approx(OF_A_LAW.k_s2 / OF_A_LAW.k_s1 * 1.05 / 0.95, rel=1e-5)


def test_law_that_is_the_papers_moves_as_the_papers():
    """To the error of a spline: a sixteenth of that of half the knots, 1.7e-5."""
    moved = [
        Forward(each, each.mean).predict(SHOT, 120.0) for each in map(Unknowns, (SMALL, OF_A_LAW))
    ]
    assert moved[1] == pytest.approx(moved[0], abs=2e-6)
