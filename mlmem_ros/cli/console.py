# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Output of sub-commands: text from a file or a node is never treated as markup."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from ..clipped import printable

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table


def plain_console(aside: bool = False) -> Console:
    """Return a console that prints every text verbatim; styles are given separately.

    Args:
        aside: Whether it writes to the standard error stream, because the result itself goes to
            the standard output as JSON.
    """
    from rich.console import Console

    return Console(markup=False, emoji=False, highlight=False, stderr=aside)


def plain_table(title: str, *headings: str) -> Table:
    """Return a table that fits 80 columns: cells are cut, words of a heading never.

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
    """Print on the standard error stream, in one line, why a sub-command failed.

    Returns:
        Its exit status.
    """
    print(printable(f'mlmem {command}: {error}'), file=sys.stderr)
    return status
