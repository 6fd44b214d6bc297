# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The benchmark of the node: load beside each figure, and no praise on a busy machine."""

import json
import subprocess
import sys
import time
from types import SimpleNamespace

import pytest

from mlmem_lab import bench
from mlmem_lab.bench.measure import MAX_OTHER_LOAD_PERCENT, Comparison, Entry, Load
from mlmem_lab.bench.node import MEASURED_FIGURES, _build_entry, keep_column
from mlmem_tools.cli.main import main

BUSY = 'import time; end = time.monotonic() + 20.0\nwhile time.monotonic() < end: pass'


def test_the_work_of_others_is_seen_and_ours_is_not():
    """A busy process is 100 % of a core if it is another's; on a loaded machine it gets less."""
    process = subprocess.Popen([sys.executable, '-c', BUSY])
    try:
        time.sleep(0.1)
        all_others, but_it = Load(), Load([process.pid])
        before = time.process_time()
        while time.process_time() < before + 0.1:
            pass
        assert all_others.others() > but_it.others() + 2.0
    finally:
        process.kill()
        process.wait()


def test_a_figure_is_good_only_on_a_quiet_machine():
    share = MEASURED_FIGURES['share']
    assert share.verdict(0.9, MAX_OTHER_LOAD_PERCENT) == 'good'
    assert share.verdict(0.9, MAX_OTHER_LOAD_PERCENT + 1.0) == 'not judged: the machine was busy'
    assert (
        share.verdict(1.1, MAX_OTHER_LOAD_PERCENT)
        == share.verdict(1.1, 2 * MAX_OTHER_LOAD_PERCENT)
        == 'above 1'
    )
    assert MEASURED_FIGURES['factor'].verdict(1e4, 0.0) == 'good'
    assert MEASURED_FIGURES['factor'].verdict(900.0, 0.0) == 'below 1000'
    assert MEASURED_FIGURES['memory'].verdict(1e9, 0.0) == ''


@pytest.fixture
def comparison():
    entries = [
        _build_entry('share', [(0.2, 3.0), (0.4, 80.0), (0.3, 5.0)]),
        _build_entry('worst', [(9, 0)]),
    ]
    return Comparison('node', '', 'value', '', entries, measured=False)


def test_a_result_file_has_a_column_for_every_processor(comparison, tmp_path):
    file = tmp_path / 'node.json'
    keep_column(comparison, file)
    rows = json.loads(file.read_text())['rows']
    (ours,) = rows[0].keys() - {'figure', 'goal'}
    names = [entry.name for entry in comparison.entries]
    assert [row['figure'] for row in rows] == ['date', 'actions', *names]
    assert [row[ours] for row in rows[2:]] == ['0.3 (busy)', '9']
    assert rows[2]['goal'] == 'at most 1'
    file.write_text(json.dumps({'rows': [{**row, ours: '7', 'another': '8'} for row in rows]}))
    keep_column(comparison, file)
    assert json.loads(file.read_text())['rows'] == [{**row, 'another': '8'} for row in rows]


def test_all_benchmarks_go_to_one_result_file_and_the_node_beside_it(
    comparison, tmp_path, monkeypatch
):
    """Which would fail after half an hour of measurements, if it failed."""
    table = Comparison('kernel', '', 'ns', '', [Entry('ours', (1.0, 2.0))], measured=False)
    made = {'kernel': [table], 'node': [comparison]}
    monkeypatch.setattr(bench, 'BENCHMARK_NAMES', dict.fromkeys(made))
    monkeypatch.setattr(bench, 'import_benchmark', lambda name: SimpleNamespace(
        TITLE='', run=lambda repeats: made[name]))  # fmt: skip
    for _ in range(2):  # the second time over what is there
        status = main(['bench', '--result', f'{tmp_path}/all.json', '--output', f'{tmp_path}/out'])
        assert status == 0
    assert main(['bench', '--result', f'{tmp_path}/a.json', '--output', f'{tmp_path}']) == 2
    assert list(json.loads((tmp_path / 'all.json').read_text())['tables']) == ['kernel']
    assert (
        len(json.loads((tmp_path / 'node.json').read_text())['rows']) == 4
    )  # with the date, and whether there are actions
