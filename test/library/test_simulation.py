# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Simulations without a device, against the chain and closed forms, and sweeps of many."""

import math
from collections.abc import Sized
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from suite import expect_rejection

from mlmem import DesignError, MemoryElement, Potential, SettingsError, load_element
from mlmem.errors import Rejected
from mlmem.parameter_sweep import sweep
from mlmem.physics import CASE_II, Scatter, Specimen, StateError, draw_specimen, find_walls
from mlmem.physics.equilibrium import find_pinned_wall
from mlmem.simulation import simulate, wall_at, walls_at


def kick(t):
    """Return the motion of the left end from s1 to s2 along 3x^2 - 2x^3, then free: the kick to
    level 4.
    """
    duration = (CASE_II.D_s2 - CASE_II.D_s1) / 0.0793  # its mean speed in cells per time unit
    x = np.clip(t / duration, 0.0, 1.0)
    moved = CASE_II.D_s1 + (CASE_II.D_s2 - CASE_II.D_s1) * (3.0 * x**2 - 2.0 * x**3)
    return np.where(t <= duration + 20.0, moved, np.nan)


def test_simulate_boundary_kick_reaches_level_of_its_speed():
    run = simulate(CASE_II, duration=2500.0, drive={1: kick})
    assert run.wall_positions[-1, 0] == pytest.approx(CASE_II.defect_site(4), abs=0.5)
    assert len(find_walls(CASE_II, run.configuration[0])) == 0


def test_simulate_pinned_walls_stay_at_their_defects():
    """Numbers of numpy are numbers."""
    numbers = {'duration': np.int64(2000), 'save_every': np.float32(100), 'strain': np.float64(0)}
    for initial, levels in ((wall_at(level=3), [3]), (walls_at([1, 4, 6]), [1, 4, 6])):
        run = simulate(CASE_II, initial=initial, **numbers)
        assert run.t == pytest.approx(np.arange(21) * 100.0)
        assert run.configuration.shape == (21, CASE_II.N)
        assert run.wall_positions.shape == (21, len(levels))
        expected = [CASE_II.defect_site(level) for level in levels]
        assert run.wall_positions[-1] == pytest.approx(expected, abs=1.0)


@pytest.mark.parametrize('save_every', [7.0, 250.0])
def test_simulate_save_interval_changes_no_physics(save_every):
    """Only the step differs: it is a whole fraction of the interval; PEFRL's error is dt^4."""
    reference = simulate(CASE_II, duration=1750.0, save_every=50.0, drive={1: kick}, dt=0.2)
    run = simulate(CASE_II, duration=1750.0, save_every=save_every, drive={1: kick}, dt=0.2)
    assert run.displacement[-1] == pytest.approx(reference.displacement[-1], abs=1e-4)


def test_simulate_undamped_wall_conserves_energy():
    run = simulate(CASE_II, initial=wall_at(position=60.0, relaxed=False), duration=500.0, eta=0.0)
    assert run.energy == pytest.approx(run.energy[0], rel=1e-5)  # PEFRL at its longest step


def test_simulate_scalar_function_gives_bits_of_array_function():
    arrays = simulate(CASE_II, duration=50.0, strain=lambda t: 0.01 * (t > 10.0))
    assert arrays.strain[-1] == pytest.approx(0.01)
    assert arrays.substrate[-1, -1] == pytest.approx(0.01 * CASE_II.N)
    scalars = simulate(CASE_II, duration=50.0, strain=lambda t: 0.01 if t > 10.0 else 0.0)
    assert np.array_equal(arrays.displacement, scalars.displacement)


def test_simulate_end_taken_later_agrees_with_chain_by_hand():
    """The end is free for 10 time units; then it is held where it is, in steps of 0.25."""
    start = find_pinned_wall(CASE_II, 0)
    start[0] += 0.05
    run = simulate(
        CASE_II, initial=start, duration=20.0, save_every=20.0, dt=0.25,
        drive={1: lambda t: np.where(t >= 10.0, CASE_II.D_s2, np.nan)},
    )  # fmt: skip
    assert run.displacement[-1, 0] == pytest.approx(CASE_II.D_s2)
    free = simulate(CASE_II, initial=start, duration=20.0, save_every=10.0, dt=0.25)
    before = simulate(
        CASE_II, initial=start, duration=10.0, save_every=10.0, dt=0.25,
        drive={1: lambda t: np.where(t >= 10.1, CASE_II.D_s2, np.nan)},
    )  # fmt: skip
    assert np.array_equal(before.displacement[-1], free.displacement[1])


def test_simulate_end_held_by_a_number_or_a_function_is_there():
    """It is taken again after a step of 0.25 from 10, which has stages until 10.045 and from
    10.205.
    """

    def hold(t):
        return np.where((t > 10.2) & (t < 10.23), np.nan, CASE_II.D_s2)

    for motion, site in ((hold, 1), (hold, CASE_II.N), (CASE_II.D_s2, 1)):
        run = simulate(CASE_II, drive={site: motion}, duration=20.0, save_every=20.0, dt=0.25)
        assert run.displacement[-1, site - 1] == CASE_II.D_s2


def test_simulate_damping_overrides_that_of_design():
    ringing = find_pinned_wall(CASE_II, 2) + 1e-3
    lossy, damped = Specimen(CASE_II, eta_factor=3.0), replace(CASE_II, eta=0.02)
    runs = [
        simulate(material, initial=ringing, duration=300.0, eta=eta)
        for material, eta in ((lossy, 0.02), (damped, None))
    ]
    assert np.array_equal(runs[0].displacement, runs[1].displacement)


@pytest.mark.parametrize(
    ('name', 'values'),
    [
        ('duration', ('10', None, 0.0, -1.0, math.nan, math.inf)),
        ('save_every', ('1', 0.0, 11.0, math.nan)),
        ('dt', ('0.1', 0.0, -1.0, math.inf)),
        ('strain', ('0.01', [0.01], lambda t: np.nan * t, lambda t: np.zeros(3))),
        ('drive', ({5: lambda t: 0.0 * t}, {1: lambda t: np.inf * t}, lambda t: 0.0 * t,
                   {1: 0.0, '225': 0.0})),
    ],
)  # fmt: skip
def test_simulate_bad_argument_is_named(name, values):
    for value in values:
        with expect_rejection(SettingsError, 'out_of_range', name):
            simulate(CASE_II, **{'duration': 10, name: value})


def test_wall_needs_a_place_of_its_own():
    with pytest.raises(ValueError, match='position, and not both'):
        wall_at()
    with expect_rejection(Rejected, 'out_of_range', 'levels'):
        walls_at([1, 3, 3])
    for design, level in ((CASE_II, 8), (CASE_II, 2.5), (replace(CASE_II, J=225), 0)):
        with expect_rejection(StateError, 'out_of_range', 'level'):
            simulate(design, initial=wall_at(level), duration=10.0)
    for place in (wall_at(position=1e9), wall_at(position=np.nan, relaxed=False)):
        with expect_rejection(Rejected, 'out_of_range', 'position'):
            simulate(CASE_II, initial=place, duration=10.0)


def test_simulate_begins_with_a_wall_or_what_a_function_returns():
    """About the ground states of the specimen."""
    made = draw_specimen(Specimen(CASE_II, offset=0.1), Scatter(offset=0.01), seed=1)
    blank = made.offsets + CASE_II.D_s1
    run = simulate(made, initial=lambda specimen: specimen.offsets + CASE_II.D_s1, duration=10.0)
    assert np.array_equal(run.configuration[0], blank)
    run = simulate(made, initial=wall_at(position=60.0, relaxed=False), duration=10.0)
    ends = [made.offsets[0] + CASE_II.D_s2, blank[-1]]
    assert run.configuration[0, [0, -1]] == pytest.approx(ends, abs=1e-6)


def test_trajectory_is_saved_drawn_and_made_a_dataset(tmp_path):
    pytest.importorskip('matplotlib').use('agg')
    pytest.importorskip('xarray')
    run = simulate(CASE_II, initial=wall_at(level=0), duration=100.0, save_every=50.0)
    with np.load(run.save(tmp_path / 'run.npz')) as file:
        assert np.array_equal(file['configuration'], run.configuration)
        assert np.array_equal(file['wall_positions'], run.wall_positions, equal_nan=True)
        assert '"J": 25' in str(file['design'])
    assert run.plot().get_xlim() == pytest.approx((0.5, CASE_II.N + 0.5), abs=1.0)
    found = run.to_xarray().configuration.sel(site=10, t=50.0)
    assert found == pytest.approx(CASE_II.D_s2, abs=1e-3)


@pytest.mark.parametrize('changes', [{'J': 225}, {'s_min': 5.0}])
def test_chain_that_is_no_memory_is_simulated_but_no_element(changes):
    chain = replace(CASE_II, **changes)
    run = simulate(
        chain, initial=wall_at(position=100.0, relaxed=False), duration=20.0, progress=False
    )
    # The barrier's top, which defines the position, is not half-way between the ground states.
    assert run.wall_positions[0, 0] == pytest.approx(100.0, abs=0.5)
    with pytest.raises(DesignError, match=r'^(J|s_min) must be'):
        MemoryElement(chain)


def test_values_of_many_numbers_have_a_short_repr():
    own = Potential.from_function(lambda D: (D**2 - 1.0) ** 2, -1.8, 1.8)
    made = draw_specimen(CASE_II, Scatter(alpha=0.01), seed=1)
    run = simulate(made, duration=10.0, save_every=5.0, progress=False)
    assert [repr(each) for each in (own, made, run, load_element('kick_2'))] == [
        'Curve(1024 forces from -1.8 to 1.8, d=1)',
        'Specimen(225 cells, with deviations)',
        'Trajectory(3 states up to t = 10, Specimen(225 cells, with deviations))',
        "Element('kick_2', Specimen(99 cells, as designed))",
    ]
    assert len(repr(replace(CASE_II, law=own))) < 400


def measure_alpha(specimen):
    return {'mean': float(specimen.alpha_factor.mean()), 'std': float(specimen.alpha_factor.std())}


def test_sweep_visits_every_combination_in_order():
    axes = {'eta': [0.002, 0.004], 'J': np.arange(24, 26), 'seeds': np.arange(1, 3)}
    table = sweep(CASE_II, measure=lambda specimen: specimen.eta, progress=False, **axes)
    assert table.columns == ('eta', 'J', 'seed', 'value')
    assert len(table) == 8
    assert np.array_equal(table['value'], table['eta'])
    assert list(table['J']) == [24, 24, 25, 25] * 2
    assert list(table['seed']) == [1, 2] * 4


def test_sweep_scatter_axis_makes_elements_of_its_seeds():
    table = sweep(CASE_II, measure=measure_alpha, alpha_std=[0.0, 0.01], seeds=range(3))
    for row in table:
        made = draw_specimen(CASE_II, Scatter(alpha=row['alpha_std']), row['seed'])
        assert row['std'] == made.alpha_factor.std()


class SizedExecutor(ThreadPoolExecutor):
    """An executor that maps no iterators, as Dask's."""

    def map(self, call, *arguments):
        assert all(isinstance(each, Sized) for each in arguments)
        return super().map(call, *arguments)


def test_sweep_executor_gives_same_table():
    axes = {'alpha_std': [0.0, 0.01], 'seeds': range(4)}
    with SizedExecutor(2) as executor:
        table = sweep(CASE_II, measure=measure_alpha, executor=executor, **axes)
    assert table == sweep(CASE_II, measure=measure_alpha, **axes)


def test_sweep_failing_measurement_reaches_caller():
    axes = {'measure': lambda specimen: 1 / 0, 'eta': [0.002, 0.004]}
    with ThreadPoolExecutor(1) as executor, pytest.raises(ZeroDivisionError):
        sweep(CASE_II, executor=executor, **axes)


@pytest.mark.parametrize(
    ('axes', 'word'),
    [
        ({'alpha': [1.0]}, 'alpha_std'), ({'eta': []}, 'eta'), ({'seeds': ()}, 'seeds'),
        ({'seeds': 3}, 'seeds'), ({'eta': 0.002}, 'eta'), ({'substrate': 'rigid'}, 'substrate'),
    ],
)  # fmt: skip
def test_sweep_bad_axis_is_named(axes, word):
    with pytest.raises(ValueError, match=word):
        sweep(CASE_II, measure=lambda specimen: specimen.eta, **axes)


@pytest.mark.parametrize('name', ['eta', 'seed'])
def test_sweep_measurement_with_the_name_of_an_axis_is_rejected(name):
    with expect_rejection(SettingsError, 'conflict', 'measure') as rejected:
        sweep(CASE_II, measure=lambda specimen: {name: 1.0, 'other': 2.0}, eta=[0.002])
    assert rejected.value.value == [name]


def test_table_is_written_as_csv_and_as_text(tmp_path):
    table = sweep(CASE_II, measure=measure_alpha, alpha_std=[0.01])
    assert table.save(tmp_path / 'table.csv').read_text().startswith('alpha_std,seed,mean,std\n')
    assert str(table).splitlines()[0].split() == ['alpha_std', 'seed', 'mean', 'std']
