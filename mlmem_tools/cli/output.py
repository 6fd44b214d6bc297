# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Output of sub-commands: text, of which none is taken as markup, and JSON for `--json`."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from mlmem.schema import make_printable

from ..json_values import to_json_value

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from mlmem_ros.bag.errors import BagError


def create_console(aside: bool = False) -> Console:
    """Return a console that prints every text verbatim; `aside`: to standard error, since standard
    output gets JSON.
    """
    from rich.console import Console

    return Console(markup=False, emoji=False, highlight=False, stderr=aside)


def create_table(title: str, *headings: str) -> Table:
    """Return a table that fits 80 columns: cells are folded, words of a heading never. A heading
    that begins with > is aligned to the right.
    """
    from rich import box
    from rich.table import Table

    table = Table(
        title=title or None,
        title_justify='left',
        box=box.SIMPLE_HEAD,
        padding=0,
        pad_edge=False,
        show_edge=False,
    )
    for heading in headings:
        text = heading.removeprefix('>')
        table.add_column(
            text,
            justify='left' if text == heading else 'right',
            min_width=max(map(len, text.split()), default=0),
            overflow='fold',
        )
    return table


def print_rows(
    console: Console, title: str, rows: Sequence[Mapping[str, Any]], columns: Sequence[str] = ()
) -> None:
    """Print mappings as a table, one a row; nothing without any.

    Args:
        console: Where.
        title: Above the table.
        rows: Their values are texts, numbers or None. They may come from a file: whatever would
            act on the terminal is replaced.
        columns: Keys to print; by default those of the first row.
    """
    cells = [
        [make_printable(_format_cell(row.get(key)), 300) for key in columns or rows[0]]
        for row in rows
    ]
    if not cells:
        return
    headings = [
        f'>{key}' if all(each == '' or _is_number(each) for each in column) else key
        for key, column in zip(columns or rows[0], zip(*cells, strict=True), strict=True)
    ]
    table = create_table(title, *headings)
    for row in cells:
        table.add_row(*row)
    console.print(table)


def _format_cell(value: Any) -> str:
    if isinstance(value, float):
        return f'{value:.4g}'
    return '' if value is None else str(value)


def _is_number(text: str) -> bool:
    try:
        return bool(float(text.split()[0]) or True)
    except (ValueError, IndexError):
        return False


@contextmanager
def show_bar(console: Console) -> Iterator[Callable[[str, float], None]]:
    """Show a progress bar; yield what sets its text, and the fraction that is done."""
    from rich import progress as shown

    columns = (
        shown.TextColumn('{task.description}'), shown.BarColumn(), shown.TimeElapsedColumn(),
        shown.TextColumn('left'), shown.TimeRemainingColumn(),
    )  # fmt: skip
    with shown.Progress(
        *columns, console=console, transient=True, speed_estimate_period=120.0
    ) as bar:
        task = bar.add_task('', total=1.0)
        yield lambda what, share: bar.update(task, description=what, completed=share)


def show_progress(console: Console, rows: Iterator[object], total: int, what: str) -> None:
    """Go through the rows, and show their number, the elapsed and the remaining time."""
    with show_bar(console) as report:
        report(f'0 of {total} {what}', 0.0)
        for number, _ in enumerate(rows, 1):
            report(f'{number} of {total} {what}', number / total)


def print_failure(command: str, error: object, status: int) -> int:
    """Print in one line on standard error why a sub-command failed; return its exit status."""
    print(make_printable(f'mlmem {command}: {error}'), file=sys.stderr)
    return status


def print_bag_failure(command: str, error: BagError, as_json: bool) -> int:
    """Print why a bag cannot be used, with `--json` also as an object with its code; return 2."""
    if as_json:
        print_json({'error': str(error), 'code': error.code})
    return print_failure(command, error, 2)


def print_json(result: Any) -> None:
    """Print a result as one JSON object.

    Args:
        result: Of mappings, sequences, dataclasses, arrays and plain values; anything else becomes
            text. JSON has no infinity and no NaN: these become null.
    """
    print(json.dumps(to_json_value(result), indent=2), flush=True)
