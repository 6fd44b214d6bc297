# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem reads`: count wrong reads over everything that ships or can be designed.

Every element is moved at random (written, erased, strained by hand, aborted) and read ten times in
a row after each move, from either end and both; also at half and a quarter of its step, and on
scattered specimens. With --cells instead, one cell is stuck, weak, strong, light or heavy, at
every site. A read or a write is wrong if it succeeds and the wall is nearest to another level, or
to none. Nothing is discarded.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from mlmem.presets import PRESETS
from mlmem_tools.cli.command import JSON_OPTION, declare_command, declare_option
from mlmem_tools.cli.output import create_console, create_table, print_failure, print_json

from ..designer.proposal import FEWEST, MOST
from ..studies.campaign.terminal import map_calls
from .count import (
    DESIGN_PREFIX,
    Counts,
    bad_cells,
    count_rows,
    find_preset,
    list_designs,
    sum_counts,
)

BAD_CELL_KINDS = ('stuck', 'alpha 0.3', 'alpha 3', 'mass 0.3', 'mass 3')

Task = tuple[str, Callable[[], Counts]]
"""The name under which counts are added, and what makes them."""


@declare_command(
    'count wrong reads over every preset and design',
    declare_option(
        'elements',
        nargs='*',
        help='presets, or designs such as levels_24; none: all designs, and the presets written '
        'by strain',
    ),
    declare_option(
        '--rows',
        type=int,
        default=20,
        help='rows of ten reads an element; at 1/2, 1/4 of its step 1/4, 1/16',
    ),
    declare_option(
        '--specimens', type=int, default=20, help='scattered specimens, four rows each'
    ),
    declare_option('--cells', action='store_true', help='count with one bad cell instead'),
    declare_option('--every', type=int, default=1, help='distance of the sites of the bad cell'),
    declare_option(
        '--reach', type=float, help='only walls within so many cells of it; default: all'
    ),
    declare_option(
        '--designs',
        type=int,
        nargs=2,
        default=(2, 64),
        help='fewest and most levels of the designs',
    ),
    declare_option('--workers', type=int, default=2, help='processes'),
    declare_option('--seed', type=int, default=1, help='of levels and ends'),
    declare_option(
        '--output', type=Path, help='result file; what it has of other elements is kept'
    ),
    JSON_OPTION,
    text=__doc__,
)
def reads(arguments: argparse.Namespace) -> int:
    """Count; return 0, 1 if anything was wrong or a file not written, 2 for a wrong argument."""
    from ..results import DEVICE_MODULES, load_kept, save_result

    if min(arguments.rows, arguments.every, arguments.workers) < 1 or arguments.specimens < 0:
        return print_failure('reads', '--rows, --every and --workers must be at least 1', 2)
    asked = arguments.elements or list_designs(*arguments.designs)
    if unknown := sorted(set(asked) - set(list_designs(FEWEST, MOST)) - set(PRESETS)):
        text = (
            f'elements are {", ".join(PRESETS)}, and {DESIGN_PREFIX}{FEWEST} to '
            f'{DESIGN_PREFIX}{MOST}'
        )
        return print_failure('reads', f'{text}; got {unknown[0]}', 2)
    tasks = list(
        _count_broken(asked, arguments) if arguments.cells else _count_whole(asked, arguments)
    )
    counts: dict[str, Counts] = {}
    console = create_console(aside=arguments.json)
    done = map_calls(console, arguments.workers, 'rows', _call_task, [do for _, do in tasks])
    for (name, _), each in zip(tasks, done, strict=True):
        counts.setdefault(name, Counts()).add(each)
    found = {name: each.as_dict() for name, each in counts.items()}
    result = {'elements': found | {'all': sum_counts(found)}}
    _print_counts(console, result['elements'])
    if arguments.output is not None:
        try:
            kept = load_kept(arguments.output)
            both = {
                name: each
                for name, each in kept.get('elements', {}).items()
                if name != 'all' and name.partition(',')[0] not in asked
            } | found
            made = _join_commands(
                arguments, kept.get('command', '') if len(both) > len(found) else ''
            )
            more = {'elements': both | {'all': sum_counts(both)}}
            modules = [*DEVICE_MODULES, 'lab/mlmem_lab/reads/count.py']
            save_result(arguments.output, more, made, modules, asked, arguments.seed, kept)
            console.print(arguments.output)
        except (OSError, ValueError) as error:
            return print_failure('reads', f'the result could not be written; {error}', 1)
    if arguments.json:
        print_json(result)
    wrong = result['elements']['all']
    return int(wrong['wrong'] + wrong['written wrong'] > 0)


def _join_commands(arguments: argparse.Namespace, before: str) -> str:
    """Return the command that made a result, behind those that made what it keeps."""
    made = f'mlmem reads --rows {arguments.rows} --specimens {arguments.specimens}'
    made += f' --cells --every {arguments.every}' if arguments.cells else ''
    made += f' --reach {arguments.reach:g}' if arguments.reach is not None else ''
    if not arguments.elements and arguments.designs != (2, 64):
        made += f' --designs {arguments.designs[0]} {arguments.designs[1]}'
    made += ''.join(f' {name}' for name in arguments.elements)
    return f'{before} && {made}' if before else made


def _call_task(do: Callable[[], Counts]) -> Counts:
    return do()


def _count_whole(asked: list[str], arguments: argparse.Namespace) -> Iterator[Task]:
    for name in asked:
        for finer in (1, 2, 4):
            count = math.ceil(arguments.rows / finer**2)
            yield name, partial(count_rows, name, count, arguments.seed, finer)
        if not name.startswith(DESIGN_PREFIX):
            for number in range(arguments.specimens):
                yield f'{name}, scattered', partial(count_rows, name, 4, arguments.seed, 1, number)


def _count_broken(asked: list[str], arguments: argparse.Namespace) -> Iterator[Task]:
    reach = math.inf if arguments.reach is None else arguments.reach
    for name in asked:
        sites = range(2, find_preset(name)[0].N, arguments.every)
        for kind in BAD_CELL_KINDS:
            for site in sites:
                write = site % (7 * arguments.every) == 2
                yield f'{name}, {kind}', partial(bad_cells, name, kind, site, write, reach)


def _print_counts(console: object, counts: Mapping[str, Mapping[str, Any]]) -> None:
    table = create_table(
        'Reads in a row', 'element', '>reads', '>right', '>undecodable', '>no level', '>wrong',
        '>ticks', '>written', '>wrongly', '>not', '>2nd try', '>lost by hand',
    )  # fmt: skip
    for name, said in counts.items():
        ticks = said['median ticks']
        columns = ('reads', 'right', 'undecodable', 'no level', 'wrong')
        writes = ('written', 'written wrong', 'not written', 'second attempts', 'lost by hand')
        table.add_row(
            name, *(str(said[key]) for key in columns), '' if ticks is None else f'{ticks:.0f}',
            *(str(said[key]) for key in writes),
        )  # fmt: skip
    console.print(table)  # type: ignore[attr-defined]
