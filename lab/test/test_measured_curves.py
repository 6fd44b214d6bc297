# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The measured lattices from the force curves of their shells."""

import numpy as np
import pytest

from mlmem.physics import NOH_BATHE, HeldCell, substep_times
from mlmem.physics.curve import Curve
from mlmem_lab.lattices import Lattice, OnSite, PowerLaw
from mlmem_lab.measured.runs import (
    ALL_CASES,
    SILENT_CASES,
    Case,
    first_crossing,
    load_runs,
    mean_speed,
)
from mlmem_lab.measured.shells import (
    ELEMENT_MASS,
    TOUCH,
    Chains,
    fit_magnets,
    launch_waves,
    load_force_table,
)
from mlmem_lab.measured.study import add_rows, predict_seen, predict_unseen


class CurveLaw(OnSite):
    """A curve of force as the law of a cell."""

    def __init__(self, curve):
        self.curve, self.origin = curve, curve.origin

    def energy(self, x):
        return np.asarray(self.curve.energy(x))

    def slope(self, x):
        return np.asarray(self.curve.slope(x))

    def constants(self, n):
        return self.curve.constants(np.full(n, self.curve.d))


def hand_motion(t, hand, well):
    """Where the hand holds the first element, and how fast it moves it."""
    x = np.minimum(t / hand, 1.0)
    return np.array((well * x * x * (3.0 - 2.0 * x), well * 6.0 * x * (1.0 - x) / hand))


def chains(name, spacing, tilt=0.01, damping=0.01):
    law, well = load_force_table(name)
    one = np.ones(1)
    return Chains(
        law[None], well * one, spacing * one, tilt * one, damping * one, 0.0 * one, one, 25.0 * one
    )  # fmt: skip


def test_the_data_have_two_runs_of_each_wave():
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
def test_the_energies_set_free_are_those_of_the_readme(name, gain):
    """mJ; it integrates from the first point, we from where the force is zero."""
    assert chains(name, 6.0, tilt=0.0).compute_gain()[0] == pytest.approx(gain, abs=0.2)


@pytest.mark.parametrize(('name', 'spacing'), [('225mm_run1', 7.0), ('180mm_run30', 6.0)])
def test_a_wave_is_that_of_the_lattice(name, spacing):
    """The same chain by the lattice's loop, Noh and Bathe's method and a spline: 1 %."""
    law, well = load_force_table(name)
    curve = Curve(-well, 2.0 * well, tuple((law - 0.01).tolist()))
    A, b, p = fit_magnets()
    lattice = Lattice(
        CurveLaw(curve),
        PowerLaw(A, -p, spacing + b, b + TOUCH),
        np.full(26, ELEMENT_MASS),
        0.2,
        damping=0.01 * ELEMENT_MASS,
        held=(26,),
    )
    lattice.place(np.full(26, curve.ground_states[0]))
    u = [lattice.displacement.copy()]
    while lattice.time < 700.0:
        t = substep_times(5, 0.2, NOH_BATHE, lattice.steps_done)
        lattice.advance(5, HeldCell(1, hand_motion(t, 25.0, well)))
        u.append(lattice.displacement.copy())
    u, t = np.array(u), np.arange(len(u), dtype=float)
    arrivals = np.array([first_crossing(t, u[:, j], 0.5 * well) for j in range(7, 11)])
    found, rise, passed = launch_waves(chains(name, spacing))
    assert found[0] == pytest.approx(mean_speed(Case(0.0, spacing), arrivals), rel=0.01)
    assert rise[0] > 0.0
    assert passed[0] >= 10


def test_a_shell_that_sets_too_little_free_is_silent():
    found, _, passed = launch_waves(chains('22mm_run11', 8.0))
    assert np.isnan(found[0])
    assert passed[0] < 5


@pytest.mark.slow
def test_predictions_have_a_row_for_every_lattice():
    """With few particles: what its data add to a lattice, and what others say of it."""
    seen = add_rows({}, 'all', predict_seen('all', 20))
    assert [row['measured'] is None for row in seen['cases']] == [
        case in SILENT_CASES for case in ALL_CASES
    ]
    for case, row in zip(ALL_CASES, seen['cases'], strict=True):
        if case not in SILENT_CASES:  # its own data narrow the interval of its speed
            widths = [row[name]['high'] - row[name]['low'] for name in ('seen', 'curves')]
            assert widths[0] < widths[1]
    unseen = add_rows({}, '22.5/6', predict_unseen('22.5/6', 20))
    assert unseen['speeds']['measured'] == 1
    assert 0.0 <= unseen['cases'][0]['unseen']['silent'] <= 1.0
