# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Output of sub-commands: text, of which none is taken as markup, and JSON for `--json`."""

from __future__ import annotations

import dataclasses
import json
import math
import sys
from collections.abc import Mapping, Sequence
from enum import Enum
from typing import TYPE_CHECKING, Any

from ..clipped import printable

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table


def plain_console(aside: bool = False) -> Console:
    """Return a console that prints every text verbatim; styles are given separately.

    Args:
        aside: Whether it writes to standard error, because standard output gets JSON.
    """
    from rich.console import Console

    return Console(markup=False, emoji=False, highlight=False, stderr=aside)


def plain_table(title: str, *headings: str) -> Table:
    """Return a table that fits 80 columns: cells are folded, words of a heading never.

    Args:
        title: What it shows.
        headings: Of the columns; one that begins with > is aligned to the right.
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


def complain(command: str, error: object, status: int) -> int:
    """Print in one line on standard error why a sub-command failed.

    Returns:
        Its exit status.
    """
    print(printable(f'mlmem {command}: {error}'), file=sys.stderr)
    return status


def print_json(result: Any) -> None:
    """Print a result as one JSON object.

    Args:
        result: Of mappings, sequences, dataclasses, arrays and plain values; anything else becomes
            text. JSON has no infinity and no NaN: these become null.
    """
    print(json.dumps(_plain(result), indent=2), flush=True)


def markdown(lines: Sequence[Sequence[str]]) -> str:
    """Return a Markdown table; the first line has the headings."""
    heading, *rows = ('| ' + ' | '.join(line) + ' |\n' for line in lines)
    return ''.join((heading, '|' + '---|' * len(lines[0]) + '\n', *rows))


def _plain(value: Any) -> Any:
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        value = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
    if isinstance(value, Enum):
        value = value.value
    if hasattr(value, 'tolist'):  # of numpy
        value = value.tolist()
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple, set, frozenset)):
        return [_plain(item) for item in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value if value is None or isinstance(value, (bool, int, str)) else str(value)
