# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The map of what loses a level, against the landscape and by what must hold of it."""

import numpy as np
import pytest

from mlmem.physics import CASE_II, Specimen
from mlmem.physics.held_wall import hold_walls
from mlmem.settings import DisturbanceSettings
from mlmem_lab.paper.figures import retention


def test_without_a_shake_and_slowly_every_level_is_kept_up_to_the_static_limit(small):
    """Two roads to one number: time-stepping, and the slope of a landscape of held walls."""
    data = small['retention']
    slow = np.argmin(data['omega'])
    held = data['amplitude'] < data['static'].min()
    assert held.any()
    assert data['kept'][slow, held].all()
    torn = data['amplitude'] > 1.3 * data['static'].max()
    assert torn.any()
    assert not data['kept'][slow, torn].any()


def test_what_is_called_harmless_harms_at_no_frequency(small):
    data = small['retention']
    harmless = data['amplitude'] <= DisturbanceSettings().harmless
    assert harmless.any()
    assert data['kept'][:, harmless].all()


def test_above_the_bands_nothing_moves(small):
    """A base that shakes faster than any wave can run drags no wall along."""
    data = small['retention']
    assert data['kept'][data['omega'] > data['bands'].max()].all()


def test_the_threshold_is_the_least_amplitude_that_loses():
    amplitude = np.array([1.0, 2.0, 3.0])
    kept = np.array([[[True], [False], [True]], [[True], [True], [True]]])
    found = retention.loss_thresholds(amplitude, kept)
    np.testing.assert_array_equal(found, [[2.0], [np.nan]])


def test_the_wall_swings_in_its_defect_at_its_own_frequency(small):
    """The landscape's curvature over the wall's mass, the sum of (dv/dX)^2, within 5 %."""
    X = np.array([25.1, 25.2, 25.3, 25.4, 25.5])
    walls = hold_walls(Specimen(CASE_II), X, np.zeros(CASE_II.N))
    curvature = 2.0 * np.polyfit(X - 25.3, walls.energy, 2)[0]
    mass = np.sum(((walls.v[3] - walls.v[1]) / 0.2) ** 2)
    assert small['retention']['wall'][0] == pytest.approx(np.sqrt(curvature / mass), rel=0.05)
