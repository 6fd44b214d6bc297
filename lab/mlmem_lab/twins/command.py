# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem twins`: count what the fit of an element is worth, over elements that nobody has seen.

fits: elements are surveyed and fitted. Are their cells inside the intervals, and how far off are
they? healthy: a twin watches reads and writes of an element in which nothing changes. How often
does it report a change? changes: a cell, the damping, the strain or a gain changes. Is that
reported, after how many reads, and how far off?

Except in fits a twin knows every alpha to 0.05 %. Nothing is discarded.
"""

from __future__ import annotations

import argparse
import shlex
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from mlmem.presets import PRESETS
from mlmem_tools.cli.command import JSON_OPTION, declare_command, declare_option
from mlmem_tools.cli.output import create_console, create_table, print_failure, print_json

from ..results import DEVICE_MODULES, load_kept, save_result
from ..studies.campaign.terminal import map_calls
from .surveyed import HIDDEN_KINDS, survey_element
from .surveyed import summarise_fits as summary_of_fits
from .watched import (
    CHANGE_KINDS,
    summarise_changed,
    summarise_healthy,
    watch_changed,
    watch_healthy,
)

Row = Mapping[str, Any]


class Part(NamedTuple):
    """Something that is counted.

    Attributes:
        one: Returns the row of an element: `one(preset, scatter, seed)`.
        summary: Returns what many rows have in common.
        columns: What a table shows of it.
        presets: Those of which it is counted if none are named.
        of: By what else entries differ: arguments of `one` by name.
    """

    one: Callable[..., Row]
    summary: Callable[[Sequence[Row]], dict[str, Any]]
    columns: tuple[str, ...]
    presets: tuple[str, ...]
    of: tuple[dict[str, str], ...] = ({},)


STUDY_PARTS = {
    'fits': Part(
        survey_element, summary_of_fits,
        ('kind', 'elements', 'fitted', 'lies', 'inside', 'error', 'most error', 'most chi2',
         'seconds'),
        ('bits_1', 'bits_4', 'case_2'), tuple({'kind': kind} for kind in HIDDEN_KINDS),
    ),
    'healthy': Part(
        watch_healthy, summarise_healthy, ('elements', 'reads', 'alarms', 'chi2', 'most chi2'),
        ('bits_4',),
    ),
    'changes': Part(
        watch_changed, summarise_changed,
        ('change', 'elements', 'told', 'named', 'reads', 'off', 'alarms'), ('bits_4',),
        tuple({'change': change} for change in CHANGE_KINDS),
    ),
}  # fmt: skip


@declare_command(
    'count what fits and twins of elements are worth',
    declare_option('parts', nargs='*', metavar='PART',
        help=f'{", ".join(STUDY_PARTS)}; none: all'),
    declare_option('--presets', nargs='+', metavar='PRESET',
        help='elements; by default, of each part its'
           ' own'),
    declare_option('--scatter', type=float, nargs='+', default=(0.01,), metavar='X',
           help='scatter of alpha, relative'),
    declare_option('--kinds', nargs='+', metavar='KIND', help='of fits, all by default: '
           + ', '.join(HIDDEN_KINDS).replace('%', '%%')),
    declare_option('--elements', type=int, default=10, help='elements of each kind'),
    declare_option('--seed', type=int, default=0, help='of the first element'),
    declare_option('--workers', type=int, default=2, help='processes'),
    declare_option('--output', type=Path,
        help='result file; what it has is kept, and not counted again'),
    JSON_OPTION,
    text=__doc__,
)  # fmt: skip
def twins(arguments: argparse.Namespace) -> int:
    """Count; return 0, 1 if a file was not written, 2 for a wrong argument."""
    if unknown := sorted(set(arguments.parts) - set(STUDY_PARTS)):
        return print_failure(
            'twins', f'a part must be one of {", ".join(STUDY_PARTS)}; got {unknown[0]}', 2
        )
    if unknown := sorted(set(arguments.presets or ()) - set(PRESETS)):
        return print_failure(
            'twins', f'a preset must be one of {", ".join(PRESETS)}; got {unknown[0]}', 2
        )
    if unknown := sorted(set(arguments.kinds or ()) - set(HIDDEN_KINDS)):
        return print_failure(
            'twins', f'a kind must be one of {", ".join(HIDDEN_KINDS)}; got {unknown[0]}', 2
        )
    if min(arguments.elements, arguments.workers) < 1 or arguments.seed < 0:
        return print_failure('twins', '--elements and --workers must be at least 1, --seed 0', 2)
    if not all(0.0 < scatter < 0.5 for scatter in arguments.scatter):
        return print_failure('twins', '--scatter must be above 0 and below 0.5', 2)
    console, output = create_console(aside=arguments.json), arguments.output
    seeds = range(arguments.seed, arguments.seed + arguments.elements)
    kinds = [
        (part, {'preset': preset, 'scatter': scatter, **other})
        for part in arguments.parts or STUDY_PARTS
        for preset in arguments.presets or STUDY_PARTS[part].presets
        for scatter in arguments.scatter
        for other in STUDY_PARTS[part].of
        if other.get('kind') in (None, *(arguments.kinds or HIDDEN_KINDS))
    ]
    try:
        known = [_load_known(output, part, kind, arguments.seed) for part, kind in kinds]
        todo = [(k, seed) for seed in seeds for k in range(len(kinds)) if seed not in known[k]]
        coming = iter(todo)

        def keep_row(row: Row) -> None:
            """Keep the row of the element that is done next."""
            k, seed = next(coming)
            known[k][seed] = row
            if output is not None:
                _keep_rows(output, *kinds[k], known[k])

        if todo:
            tasks = [(*kinds[k], seed) for k, seed in todo]
            columns = zip(*tasks, strict=True)
            map_calls(
                console, arguments.workers, 'elements', _compute_row, *columns, then=keep_row
            )
    except (OSError, ValueError) as error:
        return print_failure('twins', f'the result could not be written; {error}', 1)
    found: dict[str, list[dict[str, Any]]] = {}
    for (part, kind), rows in zip(kinds, known, strict=True):
        found.setdefault(part, []).append(_build_entry(part, kind, rows))
    for part, entries in found.items():
        table = create_table(part, 'preset', '>scatter', *STUDY_PARTS[part].columns)
        for entry in entries:
            names = 'preset', 'scatter', *STUDY_PARTS[part].columns
            table.add_row(*(_format_cell(entry.get(name)) for name in names))
        console.print(table)
    if arguments.json:
        print_json(found)
    return 0


def _compute_row(part: str, kind: Mapping[str, Any], seed: int) -> Row:
    return STUDY_PARTS[part].one(seed=seed, **kind)


def _build_entry(part: str, kind: Mapping[str, Any], rows: Mapping[int, Row]) -> dict[str, Any]:
    """Return what the elements of a kind, by seed, have in common."""
    return {**kind, 'seed': min(rows), **STUDY_PARTS[part].summary(list(rows.values()))}


def _load_known(
    path: Path | None, part: str, kind: Mapping[str, Any], seed: int
) -> dict[int, Row]:
    """Return the elements of a kind that a file has, from a first seed, by seed."""
    for entry in load_kept(path).get(part, ()) if path else ():
        if _is_same_kind(entry, kind) and entry['seed'] == seed:
            return {row['seed']: row for row in entry.get('rows', ())}
    return {}


IDENTIFYING_KEYS = 'preset', 'scatter', 'change', 'kind'
"""What tells entries apart."""


def _is_same_kind(entry: Mapping[str, Any], kind: Mapping[str, Any]) -> bool:
    return all(entry.get(key) == kind.get(key) for key in IDENTIFYING_KEYS)


def _keep_rows(path: Path, part: str, kind: Mapping[str, Any], rows: Mapping[int, Row]) -> None:
    """Put the elements of a kind into a result file, in place of what it has of this kind."""
    kept, entry = load_kept(path), _build_entry(part, kind, rows) | {'rows': list(rows.values())}
    parts = {name: list(kept.get(name, ())) for name in STUDY_PARTS}
    place = next(
        (k for k, each in enumerate(parts[part]) if _is_same_kind(each, kind)), len(parts[part])
    )
    parts[part][place : place + 1] = [entry]
    told = ' '.join([part, *(str(entry[key]) for key in IDENTIFYING_KEYS if key in entry)])
    modules = [*DEVICE_MODULES, 'lab/mlmem_lab/fit', 'lab/mlmem_lab/twins']
    save_result(path, parts, join_commands(parts, path.name), modules, [told], kept=kept)


def join_commands(parts: Mapping[str, Sequence[Mapping[str, Any]]], name: str) -> str:
    """Return the commands that make all entries of a result file of some name again."""
    kinds: dict[tuple[Any, ...], dict[str, list[str]]] = {}
    for part, entries in parts.items():
        for e in entries:
            run = kinds.setdefault((part, e['scatter'], e['elements'], e['seed']), {})
            run.setdefault(e['preset'], []).extend([e['kind']] if 'kind' in e else [])
    commands = []
    for (part, scatter, elements, seed), run in kinds.items():
        for only in dict.fromkeys(map(tuple, run.values())):
            presets = [preset for preset, own in run.items() if tuple(own) == only]
            commands.append(shlex.join([
                'mlmem', 'twins', part, '--presets', *presets, '--scatter', f'{scatter:g}',
                *(('--kinds', *only) if only else ()), '--elements', str(elements),
                '--seed', str(seed), '--output', f'lab/results/{name}',
            ]))  # fmt: skip
    return ' && '.join(commands)


def _format_cell(value: Any) -> str:
    if isinstance(value, Mapping):
        return ', '.join(f'{key} {_format_cell(each)}' for key, each in value.items())
    if isinstance(value, float):
        return f'{value:.3g}' if value < 1000.0 else f'{value:.0f}'
    return '' if value is None else str(value)
