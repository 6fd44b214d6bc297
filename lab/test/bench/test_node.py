# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The benchmark of the node: load beside each figure, and no praise on a busy machine."""

import json

import pytest

from mlmem_lab.bench.measure import Comparison
from mlmem_lab.bench.node import _build_entry, keep_column


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
