# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a standard problem is, and our answers with their errors."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mlmem.physics.values import Array

Answers = dict[str, float]
"""Quantities by name."""

ANSWERS_FILE = Path(__file__).with_name('answers.csv')


@dataclass(frozen=True)
class StandardProblem:
    """One problem, stated in the docstring of what solves it.

    Attributes:
        step: That of our answer; the problem's own unit of time.
        solve: From a step to the answers.
    """

    name: str
    step: float
    solve: Callable[[float], Answers]


@dataclass(frozen=True)
class StandardAnswer:
    """One quantity of one problem."""

    problem: str
    quantity: str
    value: float
    error: float


def crossing_site(field: Array, level: float) -> float:
    """Return the site, counted from 1, where a field last falls below a level; NaN for none."""
    above = np.flatnonzero(field >= level)
    if not above.size or above[-1] + 1 == len(field):
        return float('nan')
    j = int(above[-1])
    return float(j + 1 + (field[j] - level) / (field[j] - field[j + 1]))


def solve_problem(problem: StandardProblem) -> Iterator[StandardAnswer]:
    """Yield our answers; the error is the difference from twice the step."""
    ours, coarse = (problem.solve(step * problem.step) for step in (1, 2))
    for name, value in ours.items():
        yield StandardAnswer(problem.name, name, value, abs(value - coarse[name]))


def read_answers(path: Path) -> list[StandardAnswer]:
    """Return answers from a CSV file."""
    with path.open(newline='', encoding='utf-8') as file:
        return [
            StandardAnswer(
                row['problem'], row['quantity'], float(row['value']), float(row['error'])
            )
            for row in csv.DictReader(file)
        ]


def write_answers(path: Path, answers: Sequence[StandardAnswer]) -> None:
    """Write answers of seven digits to a CSV file; raises OSError as `open`."""
    with path.open('w', newline='', encoding='utf-8') as file:
        rows = csv.writer(file, lineterminator='\n')
        rows.writerow(['problem', 'quantity', 'value', 'error'])
        for each in answers:
            rows.writerow([each.problem, each.quantity, f'{each.value:.7g}', f'{each.error:.1e}'])
