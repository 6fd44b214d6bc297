# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Standard problems, stated in the docstrings of what solves them."""

import inspect
from typing import Any

from mlmem_lab import standard_problems
from mlmem_lab.standard_problems.problem import ANSWERS_FILE, read_answers

from .table import make_table


def generate_standard_problems() -> dict[str, str]:
    """Return the statements in the docstrings of the problems, and our answers."""
    statements = []
    for number, problem in enumerate(standard_problems.ALL_PROBLEMS, 1):
        name, statement = _split_docstring(problem.solve)
        head = f'## {number}. `{problem.name}`: {name[0].lower()}{name[1:-1]}'
        statements.append(f'{head}\n\n{statement} Step {problem.step:g}.')
    answers = [
        [f'`{one.problem}`', one.quantity, f'{one.value:.7g}', f'{one.error:.1g}']
        for one in read_answers(ANSWERS_FILE)
    ]
    return {
        'rules': _split_docstring(standard_problems)[1],
        'problems': '\n\n'.join(statements),
        'answers': make_table(['problem', 'quantity', 'value', 'error'], answers),
    }


def _split_docstring(described: Any) -> tuple[str, str]:
    """Return the first line of a docstring, and what follows it."""
    first, _, rest = (inspect.getdoc(described) or '').partition('\n\n')
    return first, rest
