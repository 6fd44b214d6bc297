# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The benchmarks compare what is equal, and mark a busy machine. No time is asserted here."""

import importlib
import json
import shutil
from types import SimpleNamespace

import numpy as np
import pytest

from mlmem_lab import results
from mlmem_lab.bench import BENCHMARK_TITLES, command
from mlmem_lab.bench.kernel import build_chain, start_c_program
from mlmem_lab.bench.measure import Contender, ResultTable, compare_costs
from mlmem_lab.bench.node import build_row, keep_column
from mlmem_tools.cli.main import main


@pytest.fixture(autouse=True)
def modules_of_one_hash(monkeypatch):
    """Hash no modules for a result that is not kept."""
    monkeypatch.setattr(results, 'hash_modules', lambda modules: 'a hash')


@pytest.mark.skipif(shutil.which('gcc') is None, reason='gcc is missing')
def test_kernels_make_the_same_steps():
    chain = build_chain()
    advance, displacements = start_c_program()
    chain.advance_steps(200)
    advance(200)
    np.testing.assert_allclose(displacements, chain.v, rtol=0, atol=1e-12)


def test_ratios_are_taken_within_a_round():
    """The second takes twice as long in every round, whatever the machine does meanwhile."""
    contenders = [Contender(name, print, 1.0) for name in 'ab']
    costs = np.array([[1.0, 2.0, 3.0], [2.0, 4.0, 6.0]])
    first, second = compare_costs(contenders, costs, 's')
    assert first == {'contender': 'a', 's': '2 ± 0.5', 'over a': '1 ± 0'}
    assert second == {'contender': 'b', 's': '4 ± 1', 'over a': '2 ± 0'}


def test_tables_are_kept_beside_others(tmp_path, monkeypatch):
    """Every benchmark is found by its name; that of others is refused."""
    for name in BENCHMARK_TITLES:
        assert callable(importlib.import_module(f'mlmem_lab.bench.{name}').run)
    assert main(['bench', 'x']) == 2
    found = ResultTable('K', 'all equal', [{'contender': 'a', 's': '1'}, {'contender': 'b'}])
    ours = SimpleNamespace(run=lambda repeats: found)
    loader = SimpleNamespace(import_module=lambda name, package: ours)
    monkeypatch.setattr(command, 'importlib', loader)  # others import modules meanwhile
    file = tmp_path / 'bench.json'
    for name in ('recorder', 'kernel'):
        assert main(['bench', name, '--result', str(file)]) == 0
    tables = json.loads(file.read_text(encoding='utf-8'))['tables']
    assert tables == {'recorder': found.rows, 'kernel': found.rows}


def test_result_of_a_node_has_a_column_for_every_processor(tmp_path):
    rows = [
        build_row('share of a core', 'at most 1', [0.2, 0.4, 0.3], 0.8),
        build_row('memory', '', [9], 0.1),
    ]
    file = tmp_path / 'node.json'
    keep_column(rows, file)
    kept = json.loads(file.read_text())['rows']
    (ours,) = kept[0].keys() - {'figure', 'goal'}
    assert [row['figure'] for row in kept] == ['date', *(row['figure'] for row in rows)]
    assert [row[ours] for row in kept[1:]] == ['0.3 (busy)', '9']  # medians
    assert kept[1]['goal'] == 'at most 1'
    file.write_text(json.dumps({'rows': [{**row, ours: '7', 'another': '8'} for row in kept]}))
    keep_column(rows, file)
    assert json.loads(file.read_text())['rows'] == [{**row, 'another': '8'} for row in kept]
