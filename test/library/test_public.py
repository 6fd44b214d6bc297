# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The public names of the library, as a first script uses them."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from rejection import expect_rejection

import mlmem
from mlmem import (
    CASE_II,
    DesignError,
    MemoryElement,
    Potential,
)


def double_well(D):
    """Ground states at -1 and 1, a barrier of 1 at 0."""
    return (D**2 - 1.0) ** 2


@pytest.mark.parametrize('wrong', ['kick_2', None, mlmem.Settings()])
def test_element_of_another_kind_is_rejected(wrong):
    with expect_rejection(DesignError, 'out_of_range', 'material'):
        MemoryElement(wrong)


def test_perform_takes_procedures_alone():
    element = MemoryElement(mlmem.load_element('bits_1'))
    with expect_rejection(mlmem.Refused, 'out_of_range', 'command'):
        element.perform(mlmem.Disturb(1e-4))
    assert element.is_still


@pytest.mark.parametrize('changes', [{'J': 225}, {'s_min': 5.0}])
def test_chain_that_is_no_memory_is_simulated_but_no_element(changes):
    chain = replace(CASE_II, **changes)
    run = mlmem.simulate(
        chain, initial=mlmem.wall_at(position=100.0, relaxed=False), duration=20.0, progress=False
    )
    # The barrier's top, which defines the position, is not half-way between the ground states.
    assert run.wall_positions[0, 0] == pytest.approx(100.0, abs=0.5)
    with pytest.raises(DesignError, match=r'^(J|s_min) must be'):
        MemoryElement(chain)


def test_potential_of_function_has_its_slope_and_ground_states():
    """The function is called only within its range: beyond 1.8 it is no number."""

    def law(D):
        return np.where(np.abs(D) <= 1.8, double_well(D), np.nan)

    own = Potential.from_function(law, -1.8, 1.8)
    assert own.ground_states == pytest.approx([-1.0, 1.0], abs=1e-9)
    assert own.barrier(0) == pytest.approx(0.0, abs=1e-9)
    D = np.linspace(-1.8, 1.8, 777)
    # A quartic through five points is exact; the spline between them is of third order.
    assert own.slope(D) == pytest.approx(4.0 * D * (D * D - 1.0), abs=1e-9)
    assert own.energy(D) == pytest.approx(double_well(D), abs=1e-9)
    assert own.stiffness(1.0) == pytest.approx(8.0, abs=1e-6)


def test_potential_of_function_of_a_number_is_that_of_arrays():
    scalar = Potential.from_function(lambda D: math.cos(D) if D < 4.0 else math.cos(4.0), 0.0, 9.0)
    array = Potential.from_function(lambda D: np.cos(np.minimum(D, 4.0)), 0.0, 9.0)
    assert scalar.force == pytest.approx(array.force, abs=1e-12)


@pytest.mark.parametrize('law', [double_well, 'law.csv', CASE_II.potential])
def test_design_with_another_law_than_a_curve_is_rejected(law):
    with expect_rejection(DesignError, 'out_of_range', 'law'):
        replace(CASE_II, law=law)


def test_copy_of_design_with_law_takes_phase_of_that_law():
    own = Potential.from_function(double_well, -1.8, 1.8)
    copy = replace(CASE_II, law=own, d=0.03)
    assert copy.phase == 0
    assert (replace(copy, N=250).phase, replace(copy, law=None).phase) == (0, 1)
    assert replace(copy, law=None) == replace(CASE_II, d=0.03)
    assert json.dumps(copy.as_dict()['phase']) == '0'
    for chosen in (replace(CASE_II, phase=1), replace(CASE_II, phase=2)):
        with expect_rejection(DesignError, 'conflict', 'phase'):
            replace(chosen, law=own)


def test_values_of_many_numbers_have_a_short_repr():
    own = Potential.from_function(double_well, -1.8, 1.8)
    made = mlmem.draw_specimen(CASE_II, mlmem.Scatter(alpha=0.01), seed=1)
    run = mlmem.simulate(made, duration=10.0, save_every=5.0, progress=False)
    assert [repr(each) for each in (own, made, run, mlmem.load_element('kick_2'))] == [
        'Curve(1024 forces from -1.8 to 1.8, d=1)',
        'Specimen(225 cells, with deviations)',
        'Trajectory(3 states up to t = 10, Specimen(225 cells, with deviations))',
        "Element('kick_2', Specimen(99 cells, as designed))",
    ]
    assert len(repr(replace(CASE_II, law=own))) < 400
