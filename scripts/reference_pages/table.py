# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Tables and lists in Markdown."""

from collections.abc import Iterable


def make_table(head: list[str], rows: Iterable[list[str]]) -> str:
    """Return a table in Markdown."""
    lines = [head, ['---'] * len(head), *rows]
    return '\n'.join(
        '| ' + ' | '.join(cell.replace('|', '&#124;') for cell in line) + ' |' for line in lines
    )


def make_list(rows: Iterable[tuple[str, str]]) -> str:
    """Return a list in Markdown: names, and what each means."""
    return '\n'.join(f'- {name}: {text}' for name, text in rows)
