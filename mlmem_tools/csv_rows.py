# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Rows of numbers in CSV files of measurements; lines that begin with # are comments."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator
from pathlib import Path

from mlmem import ErrorCode
from mlmem.parsing import DecodeError, read_file


def read_rows(path: Path) -> Iterator[tuple[str, list[str]]]:
    """Yield the rows of a file: the place of each, for messages, and its cells.

    Raises:
        DecodeError: It cannot be read, or a row has not as many cells as the first.
    """
    try:
        lines = read_file(path).splitlines()
    except DecodeError as error:
        raise DecodeError.of_error(error, place=str(path)) from error
    count = 0
    for number, line in enumerate(lines, 1):
        if line.strip() and line[:1] != '#':
            place = f'{path}, line {number}'
            try:
                cells = [cell.strip() for cell in next(csv.reader([line]))]
            except csv.Error as error:
                why = f'it must be CSV; {error}'
                raise DecodeError(ErrorCode.MALFORMED, reason=why, place=place) from error
            count = count or len(cells)
            if len(cells) != count:
                expected = f'{count} values'
                raise DecodeError(ErrorCode.CONFLICT, '', len(cells), expected, place=place)
            yield place, cells


def parse_number(text: str, place: str, field: str = '') -> float:
    """Return a finite number.

    Raises:
        DecodeError: The text is none.
    """
    try:
        if math.isfinite(value := float(text)):
            return value
    except ValueError:
        pass
    raise DecodeError(ErrorCode.OUT_OF_RANGE, field, text, 'a finite number', place=place)
