# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The result file of the node: a row for every processor on which it was measured."""

from __future__ import annotations

from datetime import date
from pathlib import Path

from .comparison import Comparison
from .host import describe_host

COLUMNS = {
    'share': 'at rest, %',
    'heard': 'heard, %',
    'shaken': 'IMU, %',
    'writing': 'writing, %',
    'busy': 'tick, us',
    'p99': 'late p99, ms',
    'latency': 'read, ms',
    'echo': 'echo service, ms',
    'ready': 'ready, s',
    'factor': 'times real time',
    'memory': 'MB',
    'hundred': '100 at rest, %',
    'hundred_memory': '100, MB',
}
"""Headings of the figures that a row has, by their keys."""


def keep_row(comparison: Comparison, file: Path) -> None:
    """Write the row of this processor to a result file, beside those of others that it has."""
    from ..results import load, save

    host = describe_host()
    processor = f'{host["processor"]}, {host["cores"]} cores'
    kept = load(file)['rows'] if file.exists() else []
    row = {
        'processor': processor,
        'date': date.today().isoformat(),
        'others, %': _short(max(entry.values['others'] for entry in comparison.entries)),
    }
    for entry in comparison.entries:
        if entry.key in COLUMNS:
            row[COLUMNS[entry.key]] = _short(entry.spread.median)
    rows = [each for each in kept if each['processor'] != processor]
    save(file, {'rows': [*rows, row]}, 'mlmem bench node --result FILE')


def _short(value: float) -> str:
    return f'{value:.3g}' if abs(value) < 1000.0 else f'{value:.0f}'
