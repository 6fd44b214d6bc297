# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem windows`: measure how far peak and times of every move may be off.

Every step up, stroke and throw of a preset, from every level, is run on a bare chain as shipped,
and with peak, all times, or one ramp 0.05, 0.1, 0.15 and 0.2 off, in 14 directions; then with
peak and times off by changes up to 0.1 that are drawn at random. It fails if the wall does not end
within a cell of its place. The distance of a move is the least of these changes at which it fails.
The result file has all moves; the table, those that a write uses.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import Any

from rich.table import Table

from mlmem_ros.device.presets import PRESETS, preset
from mlmem_ros.element_file import ElementFileError
from mlmem_ros.physics import INTEGRATORS
from mlmem_tools.cli.command import ELEMENT, JSON, command, element_of, option
from mlmem_tools.cli.output import complain, plain_console, plain_table, print_json

from ..results import APART, by, load_kept, save
from ..studies.campaign.terminal import mapped
from .window import DIRECTIONS, RADII, Window, bound, described, kind, measured, moves


@command(
    'measure how far peak and times of every move may be off',
    option('presets', nargs='*', metavar='PRESET', help=f'none: all but {" and ".join(APART)}'),
    ELEMENT,
    option('--radii', type=float, nargs='+', default=RADII, help='relative changes to try'),
    option('--points', type=int, default=100, help='random changes of every move, up to 0.1'),
    option('--seed', type=int, default=5, help='of these'),
    option('--integrator', choices=tuple(INTEGRATORS), help="in place of the preset's own"),
    option('--workers', type=int, default=2, help='processes'),
    option('--output', type=Path, help='result file; what it has of other presets is kept'),
    JSON,
    text=__doc__,
)
def windows(arguments: argparse.Namespace) -> int:
    """Measure; return 0, 1 if a move fails as shipped or a file was not written, 2 if misused."""
    if unknown := sorted(set(arguments.presets) - set(PRESETS)):
        return complain(
            'windows', f'a preset must be one of {", ".join(PRESETS)}; got {unknown[0]}', 2
        )
    if arguments.workers < 1:
        return complain('windows', '--workers must be at least 1', 2)
    if min(arguments.points, arguments.seed) < 0:
        return complain('windows', '--points and --seed must be at least 0', 2)
    radii = tuple(sorted(arguments.radii))
    if not all(0.0 < radius < 1.0 for radius in radii):
        return complain('windows', '--radii must be above 0 and below 1', 2)
    if arguments.element is not None and (len(arguments.presets) != 1 or arguments.output):
        return complain(
            'windows', '--element needs the one preset that it is of, and no --output', 2
        )
    presets = arguments.presets or [name for name in PRESETS if name not in APART]
    tasks = [(name, move) for name in presets for move in moves(name)]
    asked = [name for name, _ in tasks], [move for _, move in tasks]
    found: dict[str, list[Window]] = {name: [] for name in presets}
    console = plain_console(aside=arguments.json)
    try:
        element = element_of(arguments, *preset(presets[0]))
    except ElementFileError as error:
        return complain('windows', error, 2)
    integrator = arguments.integrator or ''
    points, seed = arguments.points, arguments.seed
    measure = partial(
        measured, integrator=integrator, radii=radii, element=element, points=points, seed=seed
    )
    done = mapped(console, arguments.workers, 'moves', measure, *asked)
    for (name, _), window in zip(tasks, done, strict=True):
        found[name].append(window)
    console.print(_table(found, radii))
    integrator = arguments.integrator or "the preset's"
    result: dict[str, Any] = {
        name: {
            'integrator': integrator,
            'radii': radii,
            'seed': seed,
            'settings': described(name),
            'moves': [each.as_dict() for each in some],
        }
        for name, some in found.items()
    }
    if arguments.output is not None:
        try:
            kept = load_kept(arguments.output)
            both = kept.get('presets', {}) | result
            made = ' '.join(['mlmem windows', *both])
            whole = {'drawn': bound(both), 'presets': both}
            of = [*presets, *by(measured, *presets)]
            console.print(save(arguments.output, whole, made, seed, of, kept))
        except (OSError, ValueError) as error:
            return complain('windows', f'the result could not be written; {error}', 1)
    if arguments.json:
        print_json(result)
    return int(any(window.distance == 0.0 for some in found.values() for window in some))


def _table(found: dict[str, list[Window]], radii: tuple[float, ...]) -> Table:
    """Return a row for every preset and kind of move: its nearest failure, and how many fail."""
    table = plain_table(
        'Windows', 'preset', 'move', '>levels', '>least', 'where', *(f'>{r:g}' for r in radii),
        '>drawn',
    )  # fmt: skip
    for name, some in found.items():
        used = {(kind(move), move.start) for move in moves(name, used=True)}
        some = [window for window in some if (window.kind, window.start) in used]
        for each in dict.fromkeys(window.kind for window in some):
            of_kind = [window for window in some if window.kind == each]
            all_failed = [f for w in of_kind for f in w.failures]
            failed = [sum(f.radius == r for f in all_failed) for r in radii]
            failed.append(sum(f.direction not in ('', *DIRECTIONS) for f in all_failed))
            table.add_row(name, each, str(len(of_kind)), *_nearest(of_kind), *map(str, failed))
    return table


def _nearest(some: Iterable[Window]) -> tuple[str, str]:
    """Return the least distance and where it is, as text."""
    near = min(some, key=lambda window: window.distance)
    if math.isinf(near.distance):
        return 'none', ''
    first = near.failures[0]
    return f'{first.radius:g}', f'{near.start} {first.direction}: {_place(first.ended)}'


def _place(level: int) -> str:
    return {-1: 'blank', -2: 'lost'}.get(level, str(level))
