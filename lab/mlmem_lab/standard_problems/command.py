# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem standard_problems`: judge the answers of any code to standard problems of domain walls.

docs/reference/standard_problems.md states the problems. Solve some of them with your own code,
write a CSV file with the columns problem, quantity, value, and get a verdict on each quantity. An
answer is right within 0.1 % of ours, or within ten times our own error.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from mlmem.schema import make_printable
from mlmem_tools.cli.command import JSON_OPTION, declare_command, declare_option
from mlmem_tools.cli.output import create_console, create_table, print_failure, print_json


@declare_command(
    'judge the answers of any code to standard problems of domain walls',
    declare_option('file', nargs='?', type=Path, help='your answers; without it ours are printed'),
    declare_option(
        '--solve', type=Path, metavar='FILE', help='solve all of them, write our answers'
    ),
    JSON_OPTION,
    text=__doc__,
)
def standard_problems(arguments: argparse.Namespace) -> int:
    """Judge; return 0, 1 for a wrong answer, 2 for a file that cannot be used."""
    from .verdict import ANSWERS_FILE, read, read_others, solve_all, write

    try:
        if arguments.solve is not None:
            write(arguments.solve, list(solve_all()))
        given = {} if arguments.file is None else read_others(arguments.file)
    except (OSError, ValueError) as error:
        return print_failure('standard_problems', error, 2)
    known = read(ANSWERS_FILE)
    names = {(each.problem, each.quantity) for each in known}
    if strange := [(p, q) for p, asked in given.items() for q in asked if (p, q) not in names]:
        told = make_printable(', '.join(f'{p}: {q}' for p, q in strange), 200)
        listed = f'there is no {told}; without a file all are listed'
        return print_failure('standard_problems', listed, 2)
    table = create_table('', 'problem', 'quantity', '>ours', '>error', '>yours', 'verdict')
    verdicts, wrong = [], 0
    for each in known:
        yours = given.get(each.problem, {}).get(each.quantity)
        right = None if yours is None else each.right(yours)
        wrong += right is False
        word = {None: '', True: 'right', False: 'wrong'}[right]
        shown = '' if yours is None else f'{yours:.7g}'
        table.add_row(
            each.problem, each.quantity, f'{each.value:.7g}', f'{each.error:.1g}', shown, word
        )
        verdicts.append({**vars(each), 'yours': yours, 'right': right})
    console = create_console(aside=arguments.json)
    console.print(table)
    if given:
        judged = sum(len(each) for each in given.values())
        console.print(f'{judged - wrong} of {judged} right')
    if arguments.json:
        print_json({'quantities': verdicts})
    return 1 if wrong else 0
