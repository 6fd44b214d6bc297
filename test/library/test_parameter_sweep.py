# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Sweeps over parameters and scattered elements."""

from collections.abc import Sized
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from rejection import expect_rejection

from mlmem import SettingsError
from mlmem.parameter_sweep import sweep
from mlmem.physics import CASE_II, Scatter, draw_specimen


def measure_eta(specimen):
    return specimen.eta


def measure_alpha(specimen):
    return {'mean': float(specimen.alpha_factor.mean()), 'std': float(specimen.alpha_factor.std())}


def test_sweep_visits_every_combination_in_order():
    axes = {'eta': [0.002, 0.004], 'J': np.arange(24, 26), 'seeds': np.arange(1, 3)}
    table = sweep(CASE_II, measure=measure_eta, progress=False, **axes)
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
    def fail(specimen):
        raise ZeroDivisionError

    with ThreadPoolExecutor(1) as executor, pytest.raises(ZeroDivisionError):
        sweep(CASE_II, measure=fail, eta=[0.002, 0.004], executor=executor)


@pytest.mark.parametrize(
    ('axes', 'word'),
    [
        ({'alpha': [1.0]}, 'alpha_std'), ({'eta': []}, 'eta'), ({'seeds': ()}, 'seeds'),
        ({'seeds': 3}, 'seeds'), ({'eta': 0.002}, 'eta'), ({'substrate': 'rigid'}, 'substrate'),
    ],
)  # fmt: skip
def test_sweep_bad_axis_is_named(axes, word):
    with pytest.raises(ValueError, match=word):
        sweep(CASE_II, measure=measure_eta, **axes)


@pytest.mark.parametrize('name', ['eta', 'seed'])
def test_sweep_measurement_with_the_name_of_an_axis_is_rejected(name):
    with expect_rejection(SettingsError, 'conflict', 'measure') as rejected:
        sweep(CASE_II, measure=lambda specimen: {name: 1.0, 'other': 2.0}, eta=[0.002])
    assert rejected.value.value == [name]


def test_table_is_written_as_csv_and_as_text(tmp_path):
    table = sweep(CASE_II, measure=measure_alpha, alpha_std=[0.01])
    assert table.save(tmp_path / 'table.csv').read_text().startswith('alpha_std,seed,mean,std\n')
    assert str(table).splitlines()[0].split() == ['alpha_std', 'seed', 'mean', 'std']
