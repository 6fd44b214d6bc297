# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The benchmarks compare what is equal. No time is asserted here."""

import json
import shutil
from types import SimpleNamespace

import numpy as np
import pytest

from mlmem_lab import bench
from mlmem_lab.bench import BENCHMARK_NAMES, import_benchmark, select_benchmarks
from mlmem_lab.bench.kernel import TIME_STEP, Problem, c_runner, numpy_runner
from mlmem_lab.bench.measure import Comparison, Entry
from mlmem_tools.cli.main import main


@pytest.fixture(scope='module')
def problem():
    return Problem.with_cells(225)


@pytest.mark.parametrize('make', [numpy_runner, c_runner])
def test_every_kernel_makes_the_same_steps(problem, make):
    if make is c_runner and shutil.which('gcc') is None:
        pytest.skip('gcc is missing')
    chain, other = problem.chain(dt=TIME_STEP), make(problem)
    chain.rest(200)
    other.advance(200)
    np.testing.assert_allclose(other.displacements(), chain.v, rtol=0, atol=1e-12)


def test_a_comparison_is_kept_whole(tmp_path, monkeypatch):
    entries = [Entry('a', (1.0, 2.0, 3.0)), Entry('b', (2.0, 4.0, 6.0))]
    for measured in (True, False):
        made = Comparison('c', 'C', 's', 't', entries, {'d': 'no'}, measured)
        assert made.table().row_count == 2
        ours = SimpleNamespace(TITLE='C', run=lambda repeats, made=made: [made])
        monkeypatch.setattr(bench, 'import_benchmark', lambda name, ours=ours: ours)
        assert main(['bench', 'kernel', '--output', str(tmp_path)]) == 0
        kept = json.loads((tmp_path / 'c.json').read_text(encoding='utf-8'))
        assert kept['entries'][1]['samples'] == [2.0, 4.0, 6.0]
        assert kept['skipped'] == {'d': 'no'}
        assert kept['host']['versions']['numpy'] == np.__version__
        assert not measured or kept['ratios'][1]['median'] == 2.0


def test_benchmarks_are_found_by_name(capsys):
    assert select_benchmarks([]) == list(BENCHMARK_NAMES)
    assert select_benchmarks(['recorder', 'kernel']) == ['kernel', 'recorder']
    with pytest.raises(KeyError, match=r"benchmark must be one of .*; got 'x'"):
        select_benchmarks(['x'])
    for name in BENCHMARK_NAMES:
        module = import_benchmark(name)
        assert module.TITLE
        assert callable(module.run)
    assert main(['bench', '--list', 'recorder', 'kernel']) == 0
    listed = ' '.join(capsys.readouterr().out.split())  # rich folds long lines
    assert (
        f'kernel {import_benchmark("kernel").TITLE} recorder {import_benchmark("recorder").TITLE}'
        == listed
    )
    assert main(['bench', 'x']) == 2
