# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The table of a campaign as a file for data analysis tools."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path

from ...durable import write_atomically
from .campaign import Row

FORMATS = ('csv', 'parquet')
"""Formats of tables; Parquet needs pyarrow."""


def save_table(rows: Sequence[Row], stem: Path, kind: str = 'csv') -> Path:
    """Write rows, all with the same names, and return the file.

    Args:
        rows: At least one.
        stem: Path without ending.
        kind: One of `FORMATS`.

    Raises:
        OSError: It cannot be written.
        ModuleNotFoundError: Parquet was requested without pyarrow installed.
    """
    path = stem.with_name(f'{stem.name}.{kind}')
    if kind == 'parquet':
        import pyarrow
        import pyarrow.parquet

        pyarrow.parquet.write_table(pyarrow.Table.from_pylist(list(rows)), path)
        return path
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator='\n')
    writer.writeheader()
    writer.writerows(rows)
    write_atomically(path, text.getvalue())
    return path
