# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Answers as CSV files: ours with their errors, and the verdict on those of others."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from mlmem import parsing
from mlmem.parsing import DecodeError
from mlmem.physics import NOH_BATHE, PEFRL
from mlmem.schema import make_printable, short_repr

from . import ALL_PROBLEMS, Answers

ANSWERS_FILE = Path(__file__).with_name('answers.csv')
MAX_RELATIVE_ERROR = 1e-3
"""Relative difference from our answer that is right; so are ten times our own error."""

ANSWER_DIGITS = 7


@dataclass(frozen=True)
class Answer:
    """One quantity of one problem."""

    problem: str
    quantity: str
    value: float
    error: float

    def right(self, value: float) -> bool:
        """Return whether another answer agrees."""
        return abs(value - self.value) <= max(
            MAX_RELATIVE_ERROR * abs(self.value), 10.0 * self.error
        )


def solve_all() -> Iterator[Answer]:
    """Solve all problems: our answer, by PEFRL.

    Its error is the larger of its differences from twice the step and from Noh-Bathe.
    """
    for problem in ALL_PROBLEMS:
        ours, coarse, other = (
            problem.solve(integrator, step * problem.step)
            for integrator, step in ((PEFRL, 1), (PEFRL, 2), (NOH_BATHE, 1))
        )
        for name, value in ours.items():
            error = max(abs(value - coarse[name]), abs(value - other[name]))
            yield Answer(problem.name, name, value, error)


def read(path: Path) -> list[Answer]:
    """Return our answers from a file."""
    with path.open(newline='', encoding='utf-8') as file:
        return [
            Answer(row['problem'], row['quantity'], float(row['value']), float(row['error']))
            for row in csv.DictReader(file)
        ]


def write(path: Path, answers: list[Answer]) -> None:
    """Write answers; errors are rounded up.

    Raises:
        OSError: The file cannot be written.
    """
    with path.open('w', newline='', encoding='utf-8') as file:
        rows = csv.writer(file, lineterminator='\n')
        rows.writerow(['problem', 'quantity', 'value', 'error'])
        for each in answers:
            value = f'{each.value:.{ANSWER_DIGITS}g}'
            rows.writerow([each.problem, each.quantity, value, f'{each.error:.1e}'])


def read_others(path: Path) -> dict[str, Answers]:
    """Return the answers of others: columns problem, quantity, value.

    Raises:
        DecodeError: The file cannot be read, has no such columns, or a value that is no number.
    """
    found: dict[str, Answers] = {}
    try:
        rows = csv.DictReader(io.StringIO(parsing.read_file(path), newline=''))
        if not {'problem', 'quantity', 'value'} <= set(rows.fieldnames or ()):
            names = short_repr(rows.fieldnames)
            raise DecodeError(f'it must have the columns problem, quantity, value; got {names}')
        for row in rows:
            try:
                value = float(row['value'])
            except (TypeError, ValueError):
                value = math.nan
            if not math.isfinite(value):
                got = make_printable(str(row['value']), 60)
                raise DecodeError(f'line {rows.line_num}: value must be a number; got {got}')
            found.setdefault(row['problem'], {})[row['quantity']] = value
    except (csv.Error, DecodeError) as error:
        raise DecodeError(f'{path}: {error}') from error
    return found
