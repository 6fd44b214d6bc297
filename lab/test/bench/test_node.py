# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The benchmark of the node: figures of a busy machine are marked."""

import json

from mlmem_lab.bench.node import build_row, keep_column

ROWS = [
    build_row('share of a core', 'at most 1', [0.2, 0.4, 0.3], 0.8),
    build_row('memory', '', [9], 0.1),
]


def test_row_has_the_median_and_a_mark_of_a_busy_machine():
    assert [row['value'] for row in ROWS] == ['0.3 (busy)', '9']


def test_result_file_has_a_column_for_every_processor(tmp_path):
    file = tmp_path / 'node.json'
    keep_column(ROWS, file)
    rows = json.loads(file.read_text())['rows']
    (ours,) = rows[0].keys() - {'figure', 'goal'}
    assert [row['figure'] for row in rows] == ['date', *(row['figure'] for row in ROWS)]
    assert [row[ours] for row in rows[1:]] == ['0.3 (busy)', '9']
    assert rows[1]['goal'] == 'at most 1'
    file.write_text(json.dumps({'rows': [{**row, ours: '7', 'another': '8'} for row in rows]}))
    keep_column(ROWS, file)
    assert json.loads(file.read_text())['rows'] == [{**row, 'another': '8'} for row in rows]
