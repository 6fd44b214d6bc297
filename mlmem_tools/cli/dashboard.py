# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A running element as a panel of text, for `mlmem watch`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from mlmem_ros.contract import calls
from mlmem_ros.device import BLANK, UNDECODABLE, describe_level

if TYPE_CHECKING:
    from mlmem_tools.view.monitor import Status, View

SPARKS = ' ▁▂▃▄▅▆▇█'
COLOURS = ('green', 'yellow', 'red', 'magenta')
"""By severity: good, warning, error, stale."""

SILENT = 3.0
"""Seconds of silence after which the panel says so; a node reports every second."""

NARROW, WIDE = 48, 100
"""Least and greatest width of the panel, in columns."""

LABELS, FRAME = 10, 5
"""Columns of the labels, and of the frame and its padding."""


def dashboard(view: View, width: int) -> Panel:
    """Return the state of an element as a panel for a terminal of some columns."""
    width = min(max(width, NARROW), WIDE)
    inner = width - LABELS - FRAME
    rows = Table.grid(padding=(0, 1))
    rows.add_column(style='dim', width=LABELS)
    rows.add_column(width=inner, no_wrap=True, overflow='ellipsis')
    rows.add_row('level', _level(view))
    rows.add_row('chain', _chain(view, inner))
    rows.add_row('', _walls(view))
    rows.add_row('strain', _strain(view, inner))
    rows.add_row('echo', _echo(view, inner))
    rows.add_row('last', _outcome(view.outcome))
    rows.add_row('rates', _rates(view.health.get('loop')))
    for name, status in view.health.items():
        rows.add_row(name, Text(f'● {status.text}', style=COLOURS[status.severity]))
    silent = view.silence > SILENT
    state = f'silent for {view.silence:.0f} s' if silent else 'listening'
    return Panel(
        rows,
        title=Text(view.name, 'bold'),
        subtitle=Text(f'{state}; Ctrl-C to leave', 'red' if silent else 'dim'),
        border_style='red' if silent else 'blue',
        width=width,
    )


def sparkline(values: Sequence[float], width: int) -> str:
    """Return values as one line of blocks, each the largest of its slice; negative ones count as
    zero.

    A square root makes small ones visible next to large ones.
    """
    top = max(values, default=0.0)
    if top <= 0.0:
        return SPARKS[0] * width
    shares = min(width, len(values))
    edges = [len(values) * share // shares for share in range(shares + 1)]
    peaks = [max(values[a:b]) for a, b in pairwise(edges)]
    last = len(SPARKS) - 1
    return ''.join(SPARKS[round(last * math.sqrt(max(0.0, peak) / top))] for peak in peaks)


def _level(view: View) -> Text:
    if view.level is None:
        return Text('not read yet', style='dim')
    if view.level == UNDECODABLE:
        text = view.content.text if view.content is not None else 'unknown'
        return Text(text, style='bold red')
    if view.level == BLANK:
        return Text('blank', style='bold')
    if view.level < UNDECODABLE:  # beyond the 16 bits of `~/level`
        values = view.content.values if view.content is not None else {}
        return Text(values.get('word', 'a word'), 'bold green')
    code = view.outcome.values.get('code', '') if view.outcome is not None else ''
    same = view.outcome is not None and view.outcome.values.get('level') == str(view.level)
    return Text.assemble(
        (str(view.level), 'bold green'), (f'   {code}' if code and same else '', 'green')
    )


def _chain(view: View, width: int) -> Text:
    """Return the chain from left to right: active cells, walls, and a tick at every level."""
    if view.walls is None:
        return Text('·' * width, style='dim')
    walls = [_column(wall, view.cells, width) for wall in view.walls]
    sites = range(view.period, view.cells, view.period)
    levels = {_column(site, view.cells, width) for site in sites}
    chain = Text()
    for column in range(width):
        if column in walls:
            chain.append('┃', 'bold yellow')
        else:
            active = sum(wall > column for wall in walls) % 2 == 1
            chain.append('┿' if column in levels else '━', 'blue' if active else 'red')
    return chain


def _column(site: float, cells: int, width: int) -> int:
    return min(width - 1, max(0, int((site - 0.5) / cells * width)))


def _walls(view: View) -> Text:
    if view.walls is None:
        return Text('')
    if not view.walls:
        return Text('no wall', style='dim')
    sites = ', '.join(f'{wall:.2f}' for wall in view.walls)
    return Text(f'wall at {sites} of {view.cells} cells', style='dim')


def _strain(view: View, width: int) -> Text:
    """Return the strain as a bar from the middle: compression to the left."""
    if view.strain is None:
        return Text('')
    half = (width - 9) // 2
    share = max(-1.0, min(1.0, view.strain / view.max_strain))
    filled = round(abs(share) * half)
    left = '━' * filled if share < 0.0 else ''
    right = '━' * filled if share > 0.0 else ''
    return Text.assemble(
        (f'{left:>{half}}', 'cyan'), ('│', 'dim'), (f'{right:<{half}}', 'magenta'),
        f' {view.strain:+.4f}',
    )  # fmt: skip


def _echo(view: View, width: int) -> Text:
    if view.echo is None:
        return Text('none yet', style='dim')
    return Text(sparkline(view.echo, width), style='green')


def _outcome(outcome: Status | None) -> Text:
    if outcome is None:
        return Text('no procedure yet', style='dim')
    if outcome.severity != 0:
        procedure = outcome.values.get('procedure', 'procedure')
        return Text(f'{procedure} failed: {outcome.text}', style=COLOURS[outcome.severity])
    parts = [outcome.text]
    if 'level' in outcome.values:
        parts.append(describe_level(calls.level_of(outcome.values)))
    for key in ('delay', 'confidence', 'attempts', 'ticks'):
        if key in outcome.values:
            parts.append(f'{key} {outcome.values[key]}')
    return Text(', '.join(parts))


def _rates(loop: Status | None) -> Text:
    if loop is None or 'rate' not in loop.values:
        return Text('no report yet', style='dim')
    late, spread, busy = (
        f'{1e3 * float(loop.values[key]):.2f}'
        for key in ('lateness_mean', 'lateness_deviation', 'busy')
    )
    return Text(
        f'{float(loop.values["rate"]):.1f} ticks/s, {loop.values["overruns"]} overruns, '
        f'late {late} ± {spread} ms, busy {busy} ms'
    )
