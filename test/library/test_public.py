# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The public names of the library, as a first script uses them."""

import inspect
from dataclasses import replace

import numpy as np
import pytest

import mlmem
from mlmem import (
    CASE_II,
    Chain,
    Design,
    DesignError,
    MemoryElement,
    Potential,
    Specimen,
    Write,
    element_file,
)
from mlmem.element_file import Element
from mlmem.physics import DEFAULT_INTEGRATOR, NOH_BATHE, default_step, find_walls
from mlmem.physics.equilibrium import find_pinned_wall
from mlmem.settings import TimeSettings


def double_well(D):
    """Ground states at -1 and 1, a barrier of 1 at 0."""
    return (D**2 - 1.0) ** 2


def test_element_is_made_and_written_by_its_name():
    element = MemoryElement(mlmem.load_element('kick_2'))
    assert element.design == mlmem.load_element('kick_2').design
    outcome = element.perform(Write(2))
    assert (outcome.success, outcome.code) == (True, 'ok')
    assert outcome.reading.content == 2
    assert 0 == outcome.start_tick < outcome.end_tick
    (wall,) = find_walls(element.design, element.chain.configuration)
    assert wall.position == pytest.approx(element.design.defect_site(2), abs=1.0)


def test_aborted_write_has_its_code():
    element = MemoryElement(mlmem.load_element('bits_1'))
    run = element.apply(Write(1))
    element.advance()
    element.apply(mlmem.Abort('test'))
    assert run.outcome.code == 'aborted'


def test_fitted_element_is_simulated_as_fitted(tmp_path):
    shipped = mlmem.load_element('bits_1')
    factor = np.linspace(0.99, 1.01, shipped.design.N)
    made = Specimen(shipped.design, factor)
    fitted = Element(made, 1e-4 * factor, time_unit=1.001, settings=shipped.settings)
    element_file.write_element_file(tmp_path / 'leg.yaml', fitted)
    element = MemoryElement(mlmem.load_element(tmp_path / 'leg.yaml'))
    assert element.settings == shipped.settings
    assert element.chain.specimen.alpha == pytest.approx(made.alpha)
    assert element.chain.specimen.masses == pytest.approx(1.001**-2)


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


def test_functions_of_specimen_take_design():
    ideal = Specimen(CASE_II)
    assert default_step(CASE_II, NOH_BATHE) == default_step(ideal, NOH_BATHE)
    assert (find_pinned_wall(CASE_II, 3) == find_pinned_wall(ideal, 3)).all()
    chain = Chain(CASE_II, 0.1, NOH_BATHE)
    chain.set_specimen(CASE_II)
    assert chain.specimen.is_ideal


def test_potential_of_function_has_its_slope_and_ground_states():
    own = Potential.from_function(double_well, -1.8, 1.8)
    assert own.ground_states == pytest.approx([-1.0, 1.0], abs=1e-9)
    assert own.barrier(0) == pytest.approx(0.0, abs=1e-9)
    D = np.linspace(-1.8, 1.8, 777)
    # A quartic through five points is exact; the spline between them is of third order.
    assert own.slope(D) == pytest.approx(4.0 * D * (D**2 - 1.0), abs=1e-9)
    assert own.energy(D) == pytest.approx(double_well(D), abs=1e-9)
    assert own.stiffness(1.0) == pytest.approx(8.0, abs=1e-6)


def test_function_is_called_only_within_its_range():
    asked = []

    def psi(D):
        asked.append((D.min(), D.max()))
        return np.sqrt(1.0 - D) + np.cos(6.0 * D)  # no number beyond 1

    Potential.from_function(psi, -1.0, 1.0 - 1e-9)
    assert min(low for low, _ in asked) >= -1.0
    assert max(high for _, high in asked) <= 1.0 - 1e-9


def test_design_with_law_starts_at_its_lowest_ground_state():
    own = Potential.from_function(double_well, -1.8, 1.8)
    design = Design(
        N=60, gamma=-1e-4, beta=-0.1, J=15, J_s=30, j_0=12.0, d=0.03, law=own
    )  # fmt: skip
    assert design.phase == 0
    assert (design.D_s1, design.D_s2) == pytest.approx((-1.0, 1.0), abs=1e-9)
    run = mlmem.simulate(design, initial=mlmem.wall_at(level=1), duration=50.0, progress=False)
    assert run.wall_positions[:, 0] == pytest.approx(30.0, abs=0.6)


def test_chain_simulation_and_device_have_one_default_integrator():
    assert Chain(CASE_II).integrator is DEFAULT_INTEGRATOR
    assert TimeSettings().integrator == DEFAULT_INTEGRATOR.name
    given = inspect.signature(mlmem.simulate).parameters['integrator']
    assert given.default == DEFAULT_INTEGRATOR.name
