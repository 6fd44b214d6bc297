# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem windows`: measure how far every move may be off.

Every move is run on a bare chain, from rest, from every level. Of a kick one quantity
after the other is off, by up to 0.3, until the wall ends elsewhere. Steps up are run as shipped,
and with peak, all times, or one ramp 0.05, 0.1, 0.15 and 0.2 off, in 14 directions; then with peak
and times off by changes up to 0.1 that are drawn at random. A step fails if the wall does not end
within a cell of its place; its distance is the least of these changes at which it fails. The
result file has the steps; `mlmem kicks` keeps the others.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from mlmem.element_file import Element
from mlmem.moves.kick import Kick, KickOut
from mlmem.physics import INTEGRATORS
from mlmem.presets import PRESETS, load_preset
from mlmem_tools.cli.command import (
    ELEMENT_OPTION,
    JSON_OPTION,
    declare_command,
    declare_option,
    load_element_option,
)
from mlmem_tools.cli.output import create_console, create_table, print_failure, print_json

from ..results import DEVICE_MODULES, STRAINED_PRESETS, load_kept, save_result
from ..studies.campaign.terminal import map_calls
from . import sent
from .sent import Sent
from .window import (
    CHANGE_RADII,
    UNIT_DIRECTIONS,
    Window,
    bound_failures,
    describe_settings,
    list_moves,
    measure_window,
)

WRITE_METHODS = ('strain', 'kick', 'auto')
"""Of writing, whose moves are measured."""


@declare_command(
    'measure how far every move may be off',
    declare_option('presets', nargs='*', metavar='FILE|PRESET', help='element files, or presets; '
           f'none: {", ".join(STRAINED_PRESETS)}'),
    declare_option('--method', choices=WRITE_METHODS, default='auto',
        help='moves by strain, kicks, '
           'or both'),
    ELEMENT_OPTION,
    declare_option('--radii', type=float, nargs='+', default=CHANGE_RADII,
        help='relative changes to try'),
    declare_option('--points', type=int, default=100,
        help='random changes of every move, up to 0.1'),
    declare_option('--seed', type=int, default=5, help='of these'),
    declare_option('--integrator', choices=tuple(INTEGRATORS),
        help="in place of the preset's own"),
    declare_option('--workers', type=int, default=2, help='processes'),
    declare_option('--output', type=Path,
        help='result file; what it has of other presets is kept'),
    JSON_OPTION,
    text=__doc__,
)  # fmt: skip
def windows(arguments: argparse.Namespace) -> int:
    """Measure; return 0, 1 if a move fails as shipped or a file was not written, 2 if misused."""
    output: Path | None = arguments.output
    presets = arguments.presets or list(STRAINED_PRESETS)
    try:
        first, *_ = [load_preset(name) for name in presets]
        element = load_element_option(arguments, *first)
    except ValueError as error:
        return print_failure('windows', error, 2)
    if output is not None and (arguments.method == 'kick' or not set(presets) <= set(PRESETS)):
        return print_failure('windows', '--output is for moves of presets that strain them', 2)
    if arguments.workers < 1:
        return print_failure('windows', '--workers must be at least 1', 2)
    if min(arguments.points, arguments.seed) < 0:
        return print_failure('windows', '--points and --seed must be at least 0', 2)
    radii = tuple(sorted(arguments.radii))
    if not all(0.0 < radius < 1.0 for radius in radii):
        return print_failure('windows', '--radii must be above 0 and below 1', 2)
    if arguments.element is not None and (len(arguments.presets) != 1 or arguments.output):
        return print_failure(
            'windows', '--element needs the one preset that it is of, and no --output', 2
        )
    console = create_console(aside=arguments.json)
    others = _measure_unstrained(arguments, presets, element, console)
    strained = presets if arguments.method != 'kick' else []
    tasks = [(name, move) for name in strained for move in list_moves(name)]
    asked = [name for name, _ in tasks], [move for _, move in tasks]
    found: dict[str, list[Window]] = {name: [] for name in strained}
    integrator = arguments.integrator or ''
    points, seed = arguments.points, arguments.seed
    measure = partial(
        measure_window,
        integrator=integrator,
        radii=radii,
        element=element,
        points=points,
        seed=seed,
    )
    done = map_calls(console, arguments.workers, 'moves', measure, *asked) if tasks else []
    for (name, _), window in zip(tasks, done, strict=True):
        found[name].append(window)
    if tasks:
        console.print(_build_table(found, radii))
    integrator = arguments.integrator or "the preset's"
    result: dict[str, Any] = {
        name: {
            'integrator': integrator,
            'radii': radii,
            'seed': seed,
            'settings': describe_settings(name),
            'moves': [each.as_dict() for each in some],
        }
        for name, some in found.items()
    }
    if output is not None:
        try:
            kept = load_kept(output)
            both = kept.get('presets', {}) | result
            made = ' '.join(['mlmem windows', *both])
            whole = {'drawn': bound_failures(both), 'presets': both}
            modules = [*DEVICE_MODULES, 'lab/mlmem_lab/windows']
            console.print(save_result(output, whole, made, modules, presets, seed, kept))
        except (OSError, ValueError) as error:
            return print_failure('windows', f'the result could not be written; {error}', 1)
    if arguments.json:
        for name, some in others.items():
            result.setdefault(name, {})['sent'] = [each.as_dict() for each in some]
        print_json(result)
    failed = any(window.distance == 0.0 for some in found.values() for window in some)
    return int(failed or any(each.fails for some in others.values() for each in some))


def _measure_unstrained(
    arguments: argparse.Namespace, presets: list[str], element: Element | None, console: Console
) -> dict[str, list[Sent]]:
    """Measure and print the kicks that are asked for, by preset."""
    found: dict[str, list[Sent]] = {name: [] for name in presets}
    tasks = [(name, move) for name in presets for move in sent.list_kicks(name)]
    if arguments.method == 'strain' or not tasks:
        return found
    names, kicks = zip(*tasks, strict=True)
    measure = partial(sent.measure_window, integrator=arguments.integrator or '', element=element)
    done = map_calls(console, arguments.workers, 'kicks', measure, names, kicks)
    for name, each in zip(names, done, strict=True):
        found[name].append(each)
    for name, some in found.items():
        for how in (Kick.name, KickOut.name):
            if of_kind := [each for each in some if each.how == how]:
                console.print(sent.build_table(name, how, of_kind))
    return found


def _build_table(found: dict[str, list[Window]], radii: tuple[float, ...]) -> Table:
    """Return a row for every preset: its nearest failure, and how many fail."""
    table = create_table(
        'Windows of steps up', 'preset', '>levels', '>least', 'where', *(f'>{r:g}' for r in radii),
        '>drawn',
    )  # fmt: skip
    for name, some in found.items():
        all_failed = [f for window in some for f in window.failures]
        failed = [sum(f.radius == r for f in all_failed) for r in radii]
        failed.append(sum(f.direction not in ('', *UNIT_DIRECTIONS) for f in all_failed))
        if some:
            table.add_row(name, str(len(some)), *_describe_nearest(some), *map(str, failed))
    return table


def _describe_nearest(some: Iterable[Window]) -> tuple[str, str]:
    """Return the least distance and where it is, as text."""
    near = min(some, key=lambda window: window.distance)
    if math.isinf(near.distance):
        return 'none', ''
    first = near.failures[0]
    return f'{first.radius:g}', f'{near.start} {first.direction}: {_describe_level(first.ended)}'


def _describe_level(level: int) -> str:
    return {-1: 'blank', -2: 'lost'}.get(level, str(level))
