# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem law`: from measured force-displacement curves to an on-site law.

A file is one run, a CSV with a header such as `displacement_mm,force_N` (um, mm, cm, m; mN, N,
kN). The law is the mean of both directions and of all runs. Printed are wells, barriers, the
energy set free on passing, its scatter between runs, and whether kicks erase walls.

Exit status 0: the law has two or more wells; 1: it has not, or could not be written; 2: a file is
no curve, or an argument is wrong.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .command import JSON_OPTION, declare_command, declare_option
from .output import create_console, print_failure, print_json, print_rows


@declare_command(
    'from measured force curves to an on-site law',
    declare_option('curves', metavar='CURVE.csv', type=Path, nargs='+', help='one run each'),
    declare_option('--output', type=Path, metavar='LAW.yaml', help='file to write'),
    declare_option('--knots', type=int, default=64, help='places of the law, 16 to 1024'),
    JSON_OPTION,
    text=__doc__,
)
def law(arguments: argparse.Namespace) -> int:
    """Read, average, tell; return the exit status."""
    from mlmem.law_file import write_law_file
    from mlmem.parsing import DecodeError

    from ..law.curves import average_runs, load_run

    if not 16 <= arguments.knots <= 1024:
        return print_failure('law', f'--knots must be from 16 to 1024; got {arguments.knots}', 2)
    try:
        found = average_runs([load_run(path) for path in arguments.curves], arguments.knots)
    except DecodeError as error:
        return print_failure('law', error, 2)
    told = found.as_dict()
    if arguments.json:
        print_json(told)
    else:
        _print_law(told)
    if (count := len(told['wells'])) < 2:
        why = f'a memory needs two wells; the mean has {_count_wells(count)}'
        return print_failure('law', why if arguments.output is None else f'{why}: not written', 1)
    if arguments.output is not None:
        try:
            write_law_file(arguments.output, found.curve, found.std)
        except OSError as error:
            return print_failure('law', f'{arguments.output} could not be written; {error}', 1)
    return 0


def _print_law(told: Mapping[str, Any]) -> None:
    """Print the quantities of a law, whether kicks erase its walls, and its runs."""
    from ..checks.budget import describe_erase

    console = create_console()
    # title and columns of a table: the name of each quantity, and its unit in SI units
    tables = {
        'wells': ('Wells', {
            'at, mm': ('displacement', 1e3), 'stiffness, N/m': ('stiffness', 1.0),
            'energy, mJ': ('energy', 1e3),
        }),
        'barriers': ('On the way to the next', {
            'peak, N': ('force', 1.0), 'barrier, mJ': ('barrier', 1e3),
            'set free, mJ': ('set_free', 1e3),
        }),
    }  # fmt: skip
    for key, (title, columns) in tables.items():
        rows = [
            {heading: _format_quantity(each, *columns[heading]) for heading in columns}
            for each in told[key]
        ]
        print_rows(console, title, rows)
    for number, step in enumerate(told['barriers']):
        if (depth := step['depth_std']) is not None:
            console.print(
                f'wells {number} and {number + 1}: their energies differ from run to run by '
                f'{depth:.2g} of the barrier (depth_std)'
            )
    for n, costs in enumerate(told['next_walls']):
        clauses = '; '.join(describe_erase(**costs))
        console.print(f'wells {n} and {n + 1}: {clauses}', soft_wrap=True)
    for run in told['runs']:
        lost = '' if run['lost'] is None else f', {1e3 * run["lost"]:.3g} mJ lost on the way'
        wells = _count_wells(run['ground_states'])
        console.print(f'{run["file"]}: {wells}{lost}', soft_wrap=True)


def _count_wells(count: int) -> str:
    return f'{count} well' if count == 1 else f'{count} wells'


def _format_quantity(values: dict[str, float | None], name: str, scale: float) -> str:
    value, spread = values[name], values[f'{name}_std']
    text = f'{scale * (value or 0.0):.4g}'
    return text if spread is None else f'{text} +- {scale * spread:.2g}'
