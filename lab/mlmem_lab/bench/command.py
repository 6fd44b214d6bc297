# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem bench`: measure our speed and that of others on this machine.

All contenders take turns within one run, so the ratios hold even on a busy machine; the absolute
numbers do not. Peers that are not installed are named and skipped.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from mlmem_tools.cli.command import JSON_OPTION, declare_command, declare_option
from mlmem_tools.cli.output import create_console, print_failure, print_json


@declare_command(
    'measure kernel, recorder and node, beside their peers',
    declare_option('names', nargs='*', metavar='NAME', help='which benchmarks; all by default'),
    declare_option('--list', action='store_true', help='list the benchmarks'),
    declare_option('--repeats', type=int, default=7, help='rounds per comparison'),
    declare_option(
        '--output', type=Path, default=Path('benchmarks'), help='folder for the results'
    ),
    declare_option(
        '--result',
        type=Path,
        help='result file of the tables; others are kept; the node has a column of node.json',
    ),
    JSON_OPTION,
    text=__doc__,
)
def bench(arguments: argparse.Namespace) -> int:
    """Run the benchmarks; return the exit status."""
    from ..results import DEVICE_MODULES, load_kept, save_result
    from . import import_benchmark, select_benchmarks

    console = create_console(aside=arguments.json)
    try:
        selected = select_benchmarks(arguments.names)
    except KeyError as error:
        return print_failure('bench', error.args[0], 2)
    if arguments.repeats < 1:
        return print_failure('bench', f'repeats must be at least 1; got {arguments.repeats}', 2)
    result = arguments.result
    if result is not None and result.resolve().parent == arguments.output.resolve():
        return print_failure(
            'bench', f'--result must be outside of {arguments.output} (--output)', 2
        )
    if arguments.list:
        for name in selected:
            console.print(f'{name:10} {import_benchmark(name).TITLE}', highlight=False)
        return 0
    arguments.output.mkdir(parents=True, exist_ok=True)
    results, tables = [], {}
    for name in selected:
        benchmark = import_benchmark(name)
        with console.status(f'{name}: {benchmark.TITLE}'):
            comparisons = benchmark.run(arguments.repeats)
        for comparison in comparisons:
            console.print(comparison.table())
            results.append(comparison.as_dict())  # with every sample
            file = arguments.output / f'{comparison.name}.json'
            file.write_text(json.dumps(results[-1], indent=1) + '\n', encoding='utf-8')
            console.print(f'{file}\n', highlight=False)
            if comparison.name != 'node':
                tables[comparison.name] = comparison.rows()
            elif arguments.result is not None:
                from .node import keep_column

                keep_column(comparison, arguments.result.with_name('node.json'))
    if arguments.json:
        print_json({'comparisons': results})
    if result is not None and tables:
        kept = load_kept(result)
        told = {'tables': kept.get('tables', {}) | tables}
        modules = [*DEVICE_MODULES, 'mlmem_ros/bag', 'lab/mlmem_lab/bench']
        save_result(result, told, 'mlmem bench --result FILE', modules, tables, kept=kept)
    return 0
