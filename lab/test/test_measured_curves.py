# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The measured lattices from the force curves of their shells."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from mlmem_lab.measured.runs import (
    ALL_CASES,
    SILENT_CASES,
    Case,
    first_crossing,
    load_runs,
    mean_speed,
)
from mlmem_lab.measured.shells import (
    ELEMENT_MASS_G,
    LAW_BOUNDS,
    MIN_MAGNET_DISTANCE_CM,
    Chains,
    fit_magnets,
    launch_waves,
    load_force_table,
)
from mlmem_lab.measured.study import compare_speeds, predict_seen, predict_unseen


def chains(name, spacing, tilt=0.01, damping=0.01):
    law, well = load_force_table(name)
    one = np.ones(1)
    return Chains(
        law[None], well * one, spacing * one, tilt * one, damping * one, 0.0 * one, one, 25.0 * one
    )  # fmt: skip


def test_measured_data_have_two_runs_of_each_wave():
    assert [len(load_runs(case)) for case in ALL_CASES] == [
        0 if case in SILENT_CASES else 2 for case in ALL_CASES
    ]


@pytest.mark.parametrize(
    ('case', 'speed', 'spread'),
    [((22.5, 6.0), 2.85, 0.05), ((22.5, 7.0), 1.88, 0.03), ((21.5, 8.0), 2.318, 0.005)],
)
def test_measured_speeds_are_those_of_the_readme(case, speed, spread):
    found = np.mean([run.speed for run in load_runs(Case(*case))])
    assert found == pytest.approx(speed, abs=spread)


@pytest.mark.parametrize(
    ('name', 'gain'),
    [('225mm_run1', 8.1), ('225mm_run2', 6.2), ('22mm_run11', -11.1), ('180mm_run32', 16.4)],
)
def test_energies_set_free_are_those_of_the_readme(name, gain):
    """mJ; it integrates from the first point, we from where the force is zero."""
    assert chains(name, 6.0, tilt=0.0).compute_gain()[0] == pytest.approx(gain, abs=0.2)


@pytest.mark.parametrize(('name', 'spacing'), [('225mm_run1', 7.0), ('180mm_run30', 6.0)])
def test_wave_is_that_of_another_integrator(name, spacing):
    """SciPy's Runge-Kutta method on the same chain, of 26 elements whose last is held: 1 %."""
    table, well = load_force_table(name)
    A, b, p = fit_magnets()
    tilt, damping, hand = 0.01, 0.01, 25.0

    def shell_force(u):
        return np.interp(u, well * np.linspace(*LAW_BOUNDS, len(table)), table) - tilt

    def push(stretch):  # of two neighbours, less that at rest
        distance = np.maximum(spacing + stretch, MIN_MAGNET_DISTANCE_CM)
        return A * ((distance + b) ** -p - (spacing + b) ** -p)

    rest = brentq(shell_force, -0.2 * well, 0.2 * well)

    def rates(t, state):
        u, v = np.array(state.reshape(2, -1))
        x = min(t / hand, 1.0)
        u[0], v[0] = well * x * x * (3.0 - 2.0 * x), 0.0
        between = push(np.diff(u))
        force = np.zeros_like(u)
        force[1:-1] = between[:-1] - between[1:] - shell_force(u[1:-1])
        acceleration = force / ELEMENT_MASS_G - damping * v
        acceleration[[0, -1]] = 0.0
        return np.concatenate((v, acceleration))

    start = np.concatenate((np.full(26, rest), np.zeros(26)))
    t = np.arange(700.0)
    u = solve_ivp(rates, (0.0, 700.0), start, t_eval=t, max_step=1.0).y[:26]
    arrivals = np.array([first_crossing(t, u[j], 0.5 * well) for j in range(7, 11)])
    found, rise, passed = launch_waves(chains(name, spacing))
    assert found[0] == pytest.approx(mean_speed(Case(0.0, spacing), arrivals), rel=0.01)
    assert rise[0] > 0.0
    assert passed[0] >= 10


def test_shell_that_sets_too_little_free_is_silent():
    found, _, passed = launch_waves(chains('22mm_run11', 8.0))
    assert np.isnan(found[0])
    assert passed[0] < 5


@pytest.mark.slow
def test_predictions_have_a_row_for_every_lattice():
    """With few particles: what its data add to a lattice, and what others say of it."""
    seen = predict_seen('all', 1, 20)
    for case in ALL_CASES:
        row = seen[str(case)]
        assert (row['measured'] is None) == (case in SILENT_CASES)
        if case not in SILENT_CASES:  # its own data narrow the interval of its speed
            widths = [row[name]['high'] - row[name]['low'] for name in ('seen', 'curves')]
            assert widths[0] < widths[1]
    case = 'rail22.5_spacing6'
    unseen = {case: predict_unseen(case, 1, 20)}
    assert compare_speeds(unseen)['speeds']['measured'] == 1
    assert 0.0 <= unseen[case]['unseen']['silent'] <= 1.0
