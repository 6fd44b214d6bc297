# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem bench`: measure our speed and that of others on this machine.

Contenders take turns, so ratios hold even on a busy machine. Peers that are not installed are
skipped.
"""

from __future__ import annotations

import argparse
import importlib
import itertools
from pathlib import Path

from mlmem_tools.cli.command import JSON_OPTION, declare_command, declare_option
from mlmem_tools.cli.output import create_console, print_failure, print_json, print_rows

from . import BENCHMARK_TITLES


@declare_command(
    'measure kernel, recorder and node, beside their peers',
    declare_option('names', nargs='*', metavar='NAME',
        help=f'which of {", ".join(BENCHMARK_TITLES)}; all by default'),
    declare_option('--repeats', type=int, default=7, help='rounds per comparison'),
    declare_option('--result', type=Path,
        help='result file of the tables'),
    JSON_OPTION,
    text=__doc__,
)  # fmt: skip
def bench(arguments: argparse.Namespace) -> int:
    """Run the benchmarks; return the exit status."""
    from ..results import load_kept, save_result
    from .node import keep_column

    console = create_console(aside=arguments.json)
    if unknown := [name for name in arguments.names if name not in BENCHMARK_TITLES]:
        known = ', '.join(BENCHMARK_TITLES)
        return print_failure('bench', f'NAME must be one of {known}; got {unknown[0]!r}', 2)
    if arguments.repeats < 1:
        return print_failure('bench', f'repeats must be at least 1; got {arguments.repeats}', 2)
    tables: dict[str, list[dict[str, str]]] = {}
    for name in arguments.names or BENCHMARK_TITLES:
        benchmark = importlib.import_module(f'.{name}', __package__)
        with console.status(f'{name}: {BENCHMARK_TITLES[name]}'):
            found = benchmark.run(arguments.repeats)
        rows = tables[name] = list(found.rows)
        print_rows(console, found.title, rows, list(dict.fromkeys(itertools.chain(*rows))))
        console.print(found.caption)
    if arguments.json:
        print_json(tables)
    if (file := arguments.result) is not None:
        if node := tables.pop('node', None):
            keep_column(node, file.with_name('node.json'))
        if tables:
            kept = load_kept(file)
            result = {'tables': kept.get('tables', {}) | tables}
            modules = ['mlmem', 'mlmem_ros/bag', 'lab/mlmem_lab/bench']
            save_result(file, result, 'mlmem bench --result FILE', modules, tables, kept=kept)
    return 0
