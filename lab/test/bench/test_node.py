# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The benchmark of the node: the load of others beside each figure."""

import json

from mlmem_lab.bench.node import build_row, keep_column

ROWS = [build_row('share', [(0.2, 3.0), (0.4, 80.0), (0.3, 5.0)]), build_row('memory', [(9, 0)])]


def test_row_has_the_median_and_the_greatest_load():
    assert (ROWS[0]['value'], ROWS[0]['others']) == ('0.3', '80')


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
