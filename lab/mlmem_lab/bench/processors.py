# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The result file of the node: a column for every processor on which it was measured."""

from __future__ import annotations

from datetime import date
from pathlib import Path

from .comparison import Comparison
from .host import describe_host
from .machine_load import QUIET
from .measure import Entry
from .node import FIGURES


def keep_column(comparison: Comparison, file: Path) -> None:
    """Write the figures of this processor to a result file, beside those of others that it has."""
    from ..results import load_kept, save

    host = describe_host()
    processor = f'{host["processor"]}, {host["cores"]} cores'
    rows = {row['figure']: row for row in load_kept(file).get('rows', ())}
    date_row = rows.setdefault('date', {'figure': 'date', 'goal': ''})
    date_row[processor] = date.today().isoformat()
    for entry in comparison.entries:
        goal = FIGURES[entry.key].in_words()
        rows.setdefault(entry.name, {'figure': entry.name, 'goal': goal})[processor] = _cell(entry)
    save(file, {'rows': list(rows.values())}, 'mlmem bench node --result FILE')


def _cell(entry: Entry) -> str:
    """Return a figure, and whether the machine was too busy for it."""
    value = entry.spread.median
    short = f'{value:.3g}' if abs(value) < 1000.0 else f'{value:.0f}'
    return short if entry.values['others'] <= QUIET else f'{short} (busy)'
