# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a benchmark returns, and how it is printed."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from .host import describe_host
from .measure import Entry, Spread

if TYPE_CHECKING:
    from rich.table import Table


@dataclass(frozen=True)
class Comparison:
    """Contenders that did the same work, measured side by side.

    Attributes:
        name: Stem of its files.
        title: What is compared.
        unit: Unit of the cost; smaller is better.
        terms: What is equal for all contenders, and what each was given.
        entries: What was measured; ratios are to the first.
        skipped: Who did not take part, and why.
        axis: What `x` of the entries is; empty if they have none.
        measured: Whether the entries are costs, with a spread and ratios, or plain results.
    """

    name: str
    title: str
    unit: str
    terms: str
    entries: Sequence[Entry]
    skipped: dict[str, str] = field(default_factory=dict)
    axis: str = ''
    measured: bool = True

    def ratio(self, entry: Entry) -> Spread:
        """Return the cost of an entry over that of the first."""
        return entry.over(self.entries[0])

    def as_dict(self) -> dict[str, Any]:
        """Return everything, every sample included."""
        values = {**dataclasses.asdict(self), 'host': describe_host()}
        if self.measured:
            values['ratios'] = [dataclasses.asdict(self.ratio(entry)) for entry in self.entries]
        return values

    def rows(self) -> list[dict[str, str]]:
        """Return the table as a row for every entry, by heading."""
        return [self._cells(entry) for entry in self.entries]

    def table(self) -> Table:
        """Return the comparison as a table for a terminal."""
        from rich.table import Table

        rows = self.rows()
        headings = list(dict.fromkeys(heading for row in rows for heading in row))
        table = Table(title=self.title, title_justify='left', caption=self._caption())
        table.caption_justify = 'left'
        for heading in headings:
            table.add_column(heading, justify='left' if heading == 'contender' else 'right')
        for row in rows:
            table.add_row(*(row.get(heading, '') for heading in headings))
        return table

    def _cells(self, entry: Entry) -> dict[str, str]:
        """Return what the table says of an entry, by heading."""
        cells = {'contender': entry.name}
        if self.axis:
            cells[self.axis] = f'{entry.x:,g}'
        if self.measured:
            cells[self.unit] = str(entry.spread)
            cells[f'over {self.entries[0].name}'] = str(self.ratio(entry))
        else:
            cells[self.unit] = f'{entry.spread.median:.3g}'
        cells |= {key: f'{value:.3g}' for key, value in entry.values.items()}
        return cells | ({'goal': entry.verdict} if entry.verdict else {})

    def _caption(self) -> str:
        lines = [self.terms]
        if self.measured:
            lines.append('median, half the quartile distance; ratios are taken within a round')
        return '\n'.join(lines + [f'{who} skipped: {why}' for who, why in self.skipped.items()])
