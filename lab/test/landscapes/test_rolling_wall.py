# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The wall as a particle: its pull against that of other designs, its motion against Newton's.

==================================  ====================================================
what scatters                       must pull as
==================================  ====================================================
alpha, all cells alike              a design with another d
ground states, all alike            hardly anything: the wall is shifted with its cells
springs k_r                         walls held over the scattered element
substrate, as another j_0 makes it  a design with that j_0, under strain
==================================  ====================================================
"""

import dataclasses

import numpy as np
import pytest

from mlmem.physics import CASE_II, Scatter, Specimen, scattered
from mlmem.physics.held_wall import hold_walls
from mlmem_lab.studies.tolerance.particle import POINTS_PER_CELL, Schedule, build_track, roll_wall

SHORT = dataclasses.replace(CASE_II, N=75)
PEAK = -0.015
LABEL = 0.15
"""The place called X is where the configuration crosses the barrier top, which a shift of the
ground states moves by itself; the particle leaves that out, about a tenth of the pull."""
LOW, HIGH = 20.0, 54.0


@pytest.fixture(scope='module')
def way():
    return build_track(SHORT, LOW, HIGH, PEAK)


def test_alpha_pulls_as_a_design_with_another_barrier(way):
    other = build_track(dataclasses.replace(SHORT, d=SHORT.d * 1.001), LOW, HIGH, PEAK)
    extra = way.deviation_force(Specimen(SHORT, alpha_factor=1.001))
    difference = other.pull[0] - way.pull[0]
    assert extra[0] == pytest.approx(difference, abs=0.01 * np.abs(difference).max())


def test_springs_pull_as_the_wall_held_over_them(way):
    """To first order, with and without strain: against walls held in the scattered element."""
    specimen = scattered(SHORT, Scatter(k_r=1e-4), seed=3)
    extra = way.deviation_force(specimen)
    X = way.low + np.arange(way.pull.shape[1]) / POINTS_PER_CELL
    for strain, row in ((0.0, 0), (PEAK, -1)):
        V = SHORT.end_displacement(strain) * SHORT.strain_shape
        there, ideal = (hold_walls(one, X, V).energy for one in (specimen, Specimen(SHORT)))
        difference = -np.gradient(there - ideal, X)
        assert extra[row] == pytest.approx(difference, abs=0.01 * np.abs(difference).max())


def test_a_shift_of_all_ground_states_hardly_pulls(way):
    one = np.zeros(SHORT.N)
    one[36] = 0.01
    extra = way.deviation_force(Specimen(SHORT, offset=0.01))
    alone = way.deviation_force(Specimen(SHORT, offset=one))
    assert np.abs(extra).max() < LABEL * np.abs(alone).max()


def test_a_substrate_that_is_not_as_designed_pulls_under_strain(way):
    other = dataclasses.replace(SHORT, j_0=SHORT.j_0 + 0.2)
    extra = way.deviation_force(Specimen(SHORT, s_factor=other.s / SHORT.s))
    difference = build_track(other, LOW, HIGH, PEAK).pull - way.pull
    assert np.abs(extra[0]).max() < 1e-12, 'nothing without strain'
    assert extra[-1] == pytest.approx(difference[-1], abs=LABEL * np.abs(difference[-1]).max())


def test_under_a_constant_pull_it_moves_as_a_damped_mass(way):
    """X'' = F / M - eta X', from rest."""
    force, time = 5e-5, 300.0
    still = Schedule(np.zeros(3000), time / 3000)
    end = roll_wall(way, np.full_like(way.pull, force), 30.0, still)
    eta = SHORT.eta
    moved = force / (way.mass * eta) * (time - (1.0 - np.exp(-eta * time)) / eta)
    assert end - 30.0 == pytest.approx(moved, rel=2e-3)


def test_its_mass_is_that_of_the_continuum(way):
    """Half of a wall's energy is in its springs: M = sum (dv/dX)^2 is the energy."""
    D = np.linspace(SHORT.D_s1, SHORT.D_s2, 4001)
    energy = np.trapezoid(np.sqrt(2.0 * SHORT.potential.energy(D)), D)
    assert way.mass == pytest.approx(energy, rel=0.03)


def test_a_wall_that_leaves_its_track_stays_out(way):
    still = Schedule(np.zeros(2000), 4.0)
    assert roll_wall(way, np.full_like(way.pull, -1e-3), 30.0, still) < LOW
    assert (
        roll_wall(way, np.full_like(way.pull, 1e-3), 30.0, still) >= HIGH - 1.0 / POINTS_PER_CELL
    )
